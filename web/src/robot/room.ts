// Reads pose and walls out of values whose exact definition is the device's own.
// Layer: web/robot, pure. Units out: metres, radians.

import type { Pose } from "./reckoning";

export interface Wall {
  x1: number;
  y1: number;
  x2: number;
  y2: number;
}

/** A pose from a struct with x, y and theta (or heading, yaw), itself or in a field `pose`; null when there is none. */
export function pose_of(value: unknown): Pose | null {
  if (typeof value !== "object" || value === null) return null;
  const fields = value as Record<string, unknown>;
  const x = number_of(fields["x"]);
  const y = number_of(fields["y"]);
  const theta = number_of(fields["theta"] ?? fields["heading"] ?? fields["yaw"]);
  if (x !== null && y !== null && theta !== null) return { x, y, theta };
  return "pose" in fields ? pose_of(fields["pose"]) : null;
}

/** Walls as a flat array x1, y1, x2, y2, ..., the same as `{dims: [4, n], data}`, or a list of structs; else none. */
export function walls_of(value: unknown): Wall[] {
  if (value === null || typeof value !== "object") return [];
  if (ArrayBuffer.isView(value)) return walls_from_flat(value as unknown as ArrayLike<number>);
  if (Array.isArray(value)) return value.flatMap(walls_from_item);
  const { data, walls } = value as { data?: unknown; walls?: unknown };
  return walls_of(data ?? walls);
}

function walls_from_item(item: unknown): Wall[] {
  if (ArrayBuffer.isView(item)) return walls_from_flat(item as unknown as ArrayLike<number>);
  const { x1, y1, x2, y2 } = (item ?? {}) as Record<string, unknown>;
  const ends = [x1, y1, x2, y2].map(number_of);
  return ends.includes(null) ? [] : walls_from_flat(ends as number[]);
}

function walls_from_flat(flat: ArrayLike<number>): Wall[] {
  const walls: Wall[] = [];
  for (let i = 0; i + 3 < flat.length; i += 4) {
    walls.push({ x1: flat[i] ?? 0, y1: flat[i + 1] ?? 0, x2: flat[i + 2] ?? 0, y2: flat[i + 3] ?? 0 });
  }
  return walls;
}

function number_of(value: unknown): number | null {
  return typeof value === "number" && Number.isFinite(value) ? value : null;
}
