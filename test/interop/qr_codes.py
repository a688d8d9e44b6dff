"""Reads QR codes as a camera would, from their modules; what has been made by a library is checked without it.

Codes of versions 1 to 5 with the least error correction: their words are one block in the order in which they are read.
Source: ISO/IEC 18004, 7.3 to 7.10
"""

DATA_WORDS = {1: 19, 2: 34, 3: 55, 4: 80, 5: 108}
FORMAT_MASK = 0x5412
LEAST_CORRECTION = 1
FINDER = ["#######", "#.....#", "#.###.#", "#.###.#", "#.###.#", "#.....#", "#######"]
MASKS = [lambda x, y: (x + y) % 2, lambda x, y: y % 2, lambda x, y: x % 3, lambda x, y: (x + y) % 3,
         lambda x, y: (x // 3 + y // 2) % 2, lambda x, y: x * y % 2 + x * y % 3, lambda x, y: (x * y % 2 + x * y % 3) % 2,
         lambda x, y: ((x + y) % 2 + x * y % 3) % 2]
HALF_BLOCKS = {" ": (False, False), "▄": (False, True), "▀": (True, False), "█": (True, True)}


def modules_on_terminal(lines, begin, end):
    """Rows of modules, True where dark, of lines of half blocks between `begin` and `end`; without the light margin around them."""
    rows = []
    for line in lines:
        assert line.startswith(begin) and line.endswith(end), line
        pairs = [HALF_BLOCKS[letter] for letter in line.removeprefix(begin).removesuffix(end)]
        rows += [[upper for upper, _ in pairs], [lower for _, lower in pairs]]
    dark = [(x, y) for y, row in enumerate(rows) for x, module in enumerate(row) if module]
    left, top = min(x for x, _ in dark), min(y for _, y in dark)
    right, bottom = max(x for x, _ in dark), max(y for _, y in dark)
    assert min(left, top, len(rows[0]) - 1 - right, len(rows) - 1 - bottom) >= 2, "no light margin"
    return [row[left:right + 1] for row in rows[top:bottom + 1]]


def read_text(modules):
    size = len(modules)
    assert all(len(row) == size for row in modules), "not a square"
    version = (size - 17) // 4
    assert size == 17 + 4 * version and version in DATA_WORDS, size
    for x, y in ((0, 0), (size - 7, 0), (0, size - 7)):
        assert ["".join(".#"[module] for module in row[x:x + 7]) for row in modules[y:y + 7]] == FINDER, (x, y)
    bits = [modules[y][8] for y in (0, 1, 2, 3, 4, 5, 7, 8)] + [modules[8][x] for x in (7, 5, 4, 3, 2, 1, 0)]
    about = (sum(bit << place for place, bit in enumerate(bits)) ^ FORMAT_MASK) >> 10
    assert about >> 3 == LEAST_CORRECTION, about
    words = read_words(modules, version, MASKS[about & 7])
    stream = "".join(f"{word:08b}" for word in words[:DATA_WORDS[version]])
    mode, length = int(stream[:4], 2), int(stream[4:12], 2)
    assert mode == 0b0100, mode  # bytes
    return bytes(int(stream[place:place + 8], 2) for place in range(12, 12 + 8 * length, 8)).decode()


def read_words(modules, version, mask):
    size = len(modules)

    def is_pattern(x, y):
        """Of the symbol itself: finders with the format, timing, and the one alignment pattern that versions 2 to 6 have."""
        in_finder = (x < 9 and (y < 9 or y >= size - 8)) or (x >= size - 8 and y < 9)
        return in_finder or x == 6 or y == 6 or (version > 1 and abs(x - (size - 7)) <= 2 and abs(y - (size - 7)) <= 2)

    bits = []
    for right in [column for column in range(size - 1, 0, -2) if column > 6] + [5, 3, 1]:
        up = (right + 1) & 2 == 0
        for step in range(size):
            y = size - 1 - step if up else step
            bits += [modules[y][x] ^ (mask(x, y) == 0) for x in (right, right - 1) if not is_pattern(x, y)]
    return [int("".join(str(int(bit)) for bit in bits[place:place + 8]), 2) for place in range(0, len(bits) - 7, 8)]
