// Which part of the floor the chart shows, and where a point of it lies on the canvas.
// Layer: web/chart, pure. Floor in metres with y up, canvas in CSS pixels with y down.

export interface Extent {
  xMin: number;
  xMax: number;
  yMin: number;
  yMax: number;
}

export interface View {
  /** Pixels a metre. */
  scale: number;
  /** The floor that is visible inside the frame. */
  extent: Extent;
  /** The inside of the frame. */
  left: number;
  top: number;
  width: number;
  height: number;
}

/** What the chart shows before anything is known: four metres around the start. */
export const START: Extent = { xMin: -2, xMax: 2, yMin: -2, yMax: 2 };

/** `extent` grown to hold the point with a margin, in half-metre steps so that the picture does not creep. */
export function include(extent: Extent, x: number, y: number, margin = 0.4): Extent {
  const down = (value: number): number => Math.floor((value - margin) * 2) / 2;
  const up = (value: number): number => Math.ceil((value + margin) * 2) / 2;
  const fits =
    x - margin >= extent.xMin && x + margin <= extent.xMax && y - margin >= extent.yMin && y + margin <= extent.yMax;
  if (fits || !Number.isFinite(x) || !Number.isFinite(y)) return extent;
  return {
    xMin: Math.min(extent.xMin, down(x)),
    xMax: Math.max(extent.xMax, up(x)),
    yMin: Math.min(extent.yMin, down(y)),
    yMax: Math.max(extent.yMax, up(y)),
  };
}

/** Fits `wanted` into the frame, whole and centred; the rest of the frame shows more floor. */
export function fit(wanted: Extent, left: number, top: number, width: number, height: number): View {
  const wide = Math.max(wanted.xMax - wanted.xMin, 0.1);
  const tall = Math.max(wanted.yMax - wanted.yMin, 0.1);
  const scale = Math.max(Math.min(width / wide, height / tall), 0.001);
  const xMid = (wanted.xMin + wanted.xMax) / 2;
  const yMid = (wanted.yMin + wanted.yMax) / 2;
  const halfX = width / scale / 2;
  const halfY = height / scale / 2;
  const extent = { xMin: xMid - halfX, xMax: xMid + halfX, yMin: yMid - halfY, yMax: yMid + halfY };
  return { scale, extent, left, top, width, height };
}

export function toCanvas(view: View, x: number, y: number): [number, number] {
  return [view.left + (x - view.extent.xMin) * view.scale, view.top + (view.extent.yMax - y) * view.scale];
}

/** Metres between labelled grid lines, so that they stand at least `minPx` apart: 0.5, 1, 2, 5, 10, ... */
export function gridStep(scale: number, minPx = 56): number {
  for (let power = 0.1; ; power *= 10) {
    for (const step of [5, 10, 20]) {
      const metres = step * power;
      if (metres * scale >= minPx) return Math.round(metres * 1e6) / 1e6;
    }
    if (power > 1e6) return power;
  }
}
