// Where the panels of a board stand: a grid of twelve columns, in which nothing overlaps and everything rises.
// Layer: web/board, pure.

export const COLUMNS = 12;
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

export const SMALLEST = { w: 2, h: 3 };

/** The same panels with `id` at `place`; whatever was there makes room below. */
export function put<T extends Placed>(panels: readonly T[], id: string, place: Partial<Place>): T[] {
  const moved = panels.find((panel) => panel.id === id);
  if (!moved) return [...panels];
  const at = { ...moved, ...within({ ...moved, ...place }) };
  const others = settle(panels.filter((panel) => panel.id !== id));
  const fixed: T[] = [at];
  for (const panel of inOrder(others)) fixed.push(fall(panel, fixed));
  const back = new Map(settle(fixed).map((panel) => [panel.id, panel]));
  return panels.map((panel) => back.get(panel.id) ?? panel);
}

/** One step on: as far as it takes to get past what stands in the way. */
export function nudge<T extends Placed>(panels: readonly T[], id: string, dx: number, dy: number): T[] {
  const from = panels.find((panel) => panel.id === id);
  if (!from) return [...panels];
  for (let step = 1; step <= MOST_ROWS; step++) {
    const next = put(panels, id, { x: from.x + dx, y: Math.max(0, from.y + dy * step) });
    const to = next.find((panel) => panel.id === id);
    if (dy <= 0 || (to && to.y > from.y)) return next;
  }
  return [...panels];
}

/** A place for one more: the first free one from the top. */
export function findRoom(panels: readonly Placed[], size: { w: number; h: number }): Place {
  const w = Math.min(size.w, COLUMNS);
  for (let y = 0; ; y++) {
    for (let x = 0; x + w <= COLUMNS; x++) {
      const place = { x, y, w, h: size.h };
      if (!panels.some((panel) => overlap(panel, place))) return place;
    }
  }
}

/** Every panel as high as it can stand. */
export function settle<T extends Placed>(panels: readonly T[]): T[] {
  const settled: T[] = [];
  for (const panel of inOrder(panels)) {
    let at: T = { ...panel, ...within(panel) };
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

function within(place: Place): Place {
  const w = clamp(Math.round(place.w), SMALLEST.w, COLUMNS);
  return {
    x: clamp(Math.round(place.x), 0, COLUMNS - w),
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
