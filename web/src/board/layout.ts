// Where the panels of a board stand: a grid of twelve columns, or more on a wide screen, in which nothing overlaps and everything rises.
// Layer: web/board, pure.

/** Of a desk. */
export const COLUMNS = 12;
/** Of the widest screen. */
export const MOST_COLUMNS = 24;
export const MOST_ROWS = 60;

/** In cells of the grid. */
export interface Place {
  x: number;
  y: number;
  w: number;
  h: number;
}

export interface Placed extends Place {
  id: string;
}

const SMALLEST = { w: 2, h: 3 };

/** The same panels with `id` at `place`; whatever was there makes room below. */
export function put<T extends Placed>(
  panels: readonly T[],
  id: string,
  place: Partial<Place>,
  columns: number = COLUMNS,
): T[] {
  const moved = panels.find((panel) => panel.id === id);
  if (!moved) return [...panels];
  const at = { ...moved, ...within({ ...moved, ...place }, columns) };
  const others = settle(
    panels.filter((panel) => panel.id !== id),
    columns,
  );
  const fixed: T[] = [at];
  for (const panel of inOrder(others)) fixed.push(fall(panel, fixed));
  const back = new Map(settle(fixed, columns).map((panel) => [panel.id, panel]));
  return panels.map((panel) => back.get(panel.id) ?? panel);
}

/** One step on: as far as it takes to get past what stands in the way. */
export function nudge<T extends Placed>(
  panels: readonly T[],
  id: string,
  dx: number,
  dy: number,
  columns: number = COLUMNS,
): T[] {
  const from = panels.find((panel) => panel.id === id);
  if (!from) return [...panels];
  for (let step = 1; step <= MOST_ROWS; step++) {
    const next = put(panels, id, { x: from.x + dx, y: Math.max(0, from.y + dy * step) }, columns);
    const to = next.find((panel) => panel.id === id);
    if (dy <= 0 || (to && to.y > from.y)) return next;
  }
  return [...panels];
}

/** A place for one more: the first free one from the top. */
export function findRoom(panels: readonly Placed[], size: { w: number; h: number }, columns: number = COLUMNS): Place {
  const w = Math.min(size.w, columns);
  for (let y = 0; ; y++) {
    for (let x = 0; x + w <= columns; x++) {
      const place = { x, y, w, h: size.h };
      if (!panels.some((panel) => overlap(panel, place))) return place;
    }
  }
}

/**
 * Panels that were arranged in `from` columns, on a screen of `columns`. On a wider one they spread in their order; on a narrower
 * one those that have no place there go where there is room.
 */
export function spread<T extends Placed>(panels: readonly T[], from: number, columns: number): T[] {
  const stays = ({ x, w }: Place): boolean => x + w <= columns && columns <= from;
  const placed = panels.filter(stays);
  for (const panel of inOrder(panels))
    if (!stays(panel)) placed.push({ ...panel, ...findRoom(placed, panel, columns) });
  const back = new Map(settle(placed, columns).map((panel) => [panel.id, panel]));
  return panels.map((panel) => back.get(panel.id) ?? panel);
}

/** Every panel as high as it can stand. */
export function settle<T extends Placed>(panels: readonly T[], columns: number = COLUMNS): T[] {
  const settled: T[] = [];
  for (const panel of inOrder(panels)) {
    let at: T = { ...panel, ...within(panel, columns) };
    while (at.y > 0 && !settled.some((other) => overlap(other, { ...at, y: at.y - 1 }))) at = { ...at, y: at.y - 1 };
    settled.push(fall(at, settled));
  }
  const back = new Map(settled.map((panel) => [panel.id, panel]));
  return panels.map((panel) => back.get(panel.id) ?? panel);
}

/** From the top, then from the left: the order on a phone, and for the keyboard. */
export function inOrder<T extends Place>(panels: readonly T[]): T[] {
  return [...panels].sort((a, b) => a.y - b.y || a.x - b.x);
}

function within(place: Place, columns: number): Place {
  const w = clamp(Math.round(place.w), SMALLEST.w, columns);
  return {
    x: clamp(Math.round(place.x), 0, columns - w),
    y: clamp(Math.round(place.y), 0, 1000),
    w,
    h: clamp(Math.round(place.h), SMALLEST.h, MOST_ROWS),
  };
}

function fall<T extends Place>(panel: T, others: readonly T[]): T {
  let at = panel;
  for (;;) {
    const below = others.filter((other) => overlap(other, at)).map((other) => other.y + other.h);
    if (below.length === 0) return at;
    at = { ...at, y: Math.max(...below) };
  }
}

function overlap(a: Place, b: Place): boolean {
  return a.x < b.x + b.w && b.x < a.x + a.w && a.y < b.y + b.h && b.y < a.y + a.h;
}

function clamp(value: number, low: number, high: number): number {
  return Math.min(high, Math.max(low, Number.isFinite(value) ? value : low));
}
