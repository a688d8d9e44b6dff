// A small plot of the last seconds of a few numbers.
// Layer: web/chart.

import { useEffect } from "preact/hooks";
import type { Series } from "../robot/series";
import type { Palette } from "./palette";
import { useCanvas } from "./use_canvas";

const WINDOW_MS = 30_000;

export interface PlotProps {
  series: readonly Series[];
  /** What a screen reader says in place of the picture. */
  label: string;
  /** The smallest span of the value axis: noise must not look like a storm. */
  minSpan?: number;
  /** Which of the palette's series colours the first line takes. */
  firstColour?: number;
  /** Whether values still arrive: the time axis stands still otherwise. */
  live?: boolean;
}

export function Plot({ series, label, minSpan = 1, firstColour = 0, live = true }: PlotProps) {
  const { canvas, redraw } = useCanvas((ctx, width, height, palette) => {
    drawPlot(ctx, width, height, series, palette, minSpan, firstColour, live ? performance.now() : newestOf(series));
  });
  useEffect(() => {
    redraw();
    if (!live) return;
    // Ten pictures a second; where motion is unwelcome, the plot steps once a second instead of gliding.
    const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    const timer = setInterval(redraw, calm ? 1000 : 100);
    return () => clearInterval(timer);
  }, [live, redraw, series]);
  return <canvas ref={canvas} class="plot" role="img" aria-label={label} />;
}

function newestOf(series: readonly Series[]): number {
  return Math.max(0, ...series.map((s) => s.newest?.t ?? 0));
}

function drawPlot(
  ctx: CanvasRenderingContext2D,
  width: number,
  height: number,
  series: readonly Series[],
  palette: Palette,
  minSpan: number,
  firstColour: number,
  now: number,
): void {
  const [low, high] = spanOf(series, minSpan);
  const pad = 4;
  const xOf = (t: number): number => width - ((now - t) / WINDOW_MS) * width;
  const yOf = (value: number): number => pad + ((high - value) / (high - low)) * (height - 2 * pad);
  ctx.strokeStyle = palette.line;
  ctx.lineWidth = 1;
  ctx.beginPath();
  for (let t = 0; t <= WINDOW_MS; t += 10_000) {
    const x = Math.round((t / WINDOW_MS) * (width - 1)) + 0.5;
    ctx.moveTo(x, 0);
    ctx.lineTo(x, height);
  }
  if (low < 0 && high > 0) {
    ctx.moveTo(0, Math.round(yOf(0)) + 0.5);
    ctx.lineTo(width, Math.round(yOf(0)) + 0.5);
  }
  ctx.stroke();
  ctx.lineWidth = 1.75;
  ctx.lineJoin = "round";
  series.forEach((one, index) => {
    ctx.strokeStyle = palette.series[(firstColour + index) % palette.series.length] ?? palette.accent;
    ctx.beginPath();
    let drawing = false;
    for (const { t, value } of one.samples) {
      if (t < now - WINDOW_MS - 1000) continue;
      if (drawing) ctx.lineTo(xOf(t), yOf(value));
      else ctx.moveTo(xOf(t), yOf(value));
      drawing = true;
    }
    ctx.stroke();
  });
}

function spanOf(series: readonly Series[], minSpan: number): [number, number] {
  let low = Infinity;
  let high = -Infinity;
  for (const one of series) {
    for (const { value } of one.samples) {
      low = Math.min(low, value);
      high = Math.max(high, value);
    }
  }
  if (low > high) return [0, minSpan];
  const missing = Math.max(0, minSpan - (high - low)) / 2;
  return [low - missing, high + missing];
}
