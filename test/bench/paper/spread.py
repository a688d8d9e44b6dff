"""A picture of how latencies are spread: a row for each way, darker where more calls fell, on a logarithmic scale."""
import html
import math

LEFT, RIGHT, ROW, TOP, BOTTOM = 430, 980, 26, 16, 34  # pixels
CELLS = 110


def draw(results):
    """SVG. `results`: microseconds, sorted, by way."""
    least = min(times[0] for times in results.values())
    most = max(times[len(times) * 999 // 1000] for times in results.values())
    low, high = math.floor(10 * math.log10(least)) / 10, math.ceil(10 * math.log10(most)) / 10

    def x_of(microseconds):
        return LEFT + (RIGHT - LEFT) * (math.log10(microseconds) - low) / (high - low)

    height = TOP + ROW * len(results) + BOTTOM
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {RIGHT + 20} {height}" font-family="sans-serif" font-size="13">',
             "<title>Latencies of an empty call</title>", f'<rect width="100%" height="{height}" fill="#fff"/>']
    for mark in ticks(low, high):
        x = x_of(mark)
        parts.append(f'<path d="M{x:.1f} {TOP}V{height - BOTTOM}" stroke="#ccc"/>'
                     f'<text x="{x:.1f}" y="{height - 12}" text-anchor="middle">{words(mark)}</text>')
    for number, (name, times) in enumerate(results.items()):
        y = TOP + ROW * number
        parts.append(f'<text x="{LEFT - 8}" y="{y + 17}" text-anchor="end">{html.escape(name)}</text>')
        parts += ['<g fill="#0b5cad">', *cells(times, low, high, y), "</g>"]
        x = x_of(times[len(times) // 2])
        parts.append(f'<path d="M{x:.1f} {y + 3}v{ROW - 6}" stroke="#c00" stroke-width="2"><title>median {times[len(times) // 2]:.1f} µs</title></path>')
    return "\n".join([*parts, "</svg>", ""])


def words(microseconds):
    return f"{microseconds:g} µs" if microseconds < 1000 else f"{microseconds / 1000:g} ms"


def ticks(low, high):
    return [digit * 10.0 ** power for power in range(math.floor(low), math.ceil(high) + 1) for digit in (1, 2, 5)
            if low <= math.log10(digit * 10.0 ** power) <= high]


def cells(times, low, high, y):
    counts = [0] * CELLS
    for time in times:
        counts[min(CELLS - 1, max(0, int(CELLS * (math.log10(time) - low) / (high - low))))] += 1
    width, top = (RIGHT - LEFT) / CELLS, max(counts)
    return [f'<path d="M{LEFT + i * width:.1f} {y + 3}h{width:.1f}v{ROW - 6}h-{width:.1f}" opacity="{(count / top) ** 0.5:.2f}"/>'
            for i, count in enumerate(counts) if count > top / 2000]
