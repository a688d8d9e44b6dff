// Which part of the floor the chart shows, and where a point of it lies on the canvas.
// Layer: web/chart, pure. Floor in metres with y up, canvas in CSS pixels with y down.

export interface Extent {
  x_min: number;
  x_max: number;
  y_min: number;
  y_max: number;
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
export const START: Extent = { x_min: -2, x_max: 2, y_min: -2, y_max: 2 };

/** `extent` grown to hold the point with a margin, in half-metre steps so that the picture does not creep. */
export function include(extent: Extent, x: number, y: number, margin = 0.4): Extent {
  const down = (value: number): number => Math.floor((value - margin) * 2) / 2;
  const up = (value: number): number => Math.ceil((value + margin) * 2) / 2;
  const fits =
    x - margin >= extent.x_min && x + margin <= extent.x_max && y - margin >= extent.y_min && y + margin <= extent.y_max;
  if (fits || !Number.isFinite(x) || !Number.isFinite(y)) return extent;
  return {
    x_min: Math.min(extent.x_min, down(x)),
    x_max: Math.max(extent.x_max, up(x)),
    y_min: Math.min(extent.y_min, down(y)),
    y_max: Math.max(extent.y_max, up(y)),
  };
}

/** Fits `wanted` into the frame, whole and centred; the rest of the frame shows more floor. */
export function fit(wanted: Extent, left: number, top: number, width: number, height: number): View {
  const wide = Math.max(wanted.x_max - wanted.x_min, 0.1);
  const tall = Math.max(wanted.y_max - wanted.y_min, 0.1);
  const scale = Math.max(Math.min(width / wide, height / tall), 0.001);
  const x_mid = (wanted.x_min + wanted.x_max) / 2;
  const y_mid = (wanted.y_min + wanted.y_max) / 2;
  const half_x = width / scale / 2;
  const half_y = height / scale / 2;
  const extent = { x_min: x_mid - half_x, x_max: x_mid + half_x, y_min: y_mid - half_y, y_max: y_mid + half_y };
  return { scale, extent, left, top, width, height };
}

export function to_canvas(view: View, x: number, y: number): [number, number] {
  return [
    view.left + (x - view.extent.x_min) * view.scale,
    view.top + (view.extent.y_max - y) * view.scale,
  ];
}

/** Metres between labelled grid lines, so that they stand at least `min_px` apart: 0.5, 1, 2, 5, 10, ... */
export function grid_step(scale: number, min_px = 56): number {
  for (let power = 0.1; ; power *= 10) {
    for (const step of [5, 10, 20]) {
      const metres = step * power;
      if (metres * scale >= min_px) return Math.round(metres * 1e6) / 1e6;
    }
    if (power > 1e6) return power;
  }
}
