// Reads pose, walls and obstacles out of values whose exact definition is the device's own.
// Layer: web/robot, pure. Units out: metres, radians.

import type { Pose } from "./reckoning";

export interface Wall {
  x1: number;
  y1: number;
  x2: number;
  y2: number;
}

/** A round thing that stands in the room. */
export interface Obstacle {
  x: number;
  y: number;
  radius: number;
}

export interface Room {
  walls: readonly Wall[];
  obstacles: readonly Obstacle[];
}

export const EMPTY_ROOM: Room = { walls: [], obstacles: [] };

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

/**
 * Walls that join end to end and come back to where they began, as corners; and the walls that do not.
 * Walls of one loop follow each other in the list.
 */
export function loops_of(walls: readonly Wall[]): { loops: { x: number; y: number }[][]; open: Wall[] } {
  const loops: { x: number; y: number }[][] = [];
  const open: Wall[] = [];
  let chain: Wall[] = [];
  const same = (ax: number, ay: number, bx: number, by: number): boolean => Math.hypot(ax - bx, ay - by) < 1e-3;
  for (const wall of walls) {
    const last = chain[chain.length - 1];
    if (last && !same(last.x2, last.y2, wall.x1, wall.y1)) {
      open.push(...chain);
      chain = [];
    }
    chain.push(wall);
    const first = chain[0];
    if (first && chain.length > 2 && same(first.x1, first.y1, wall.x2, wall.y2)) {
      loops.push(chain.map(({ x1, y1 }) => ({ x: x1, y: y1 })));
      chain = [];
    }
  }
  return { loops, open: [...open, ...chain] };
}

function number_of(value: unknown): number | null {
  return typeof value === "number" && Number.isFinite(value) ? value : null;
}
