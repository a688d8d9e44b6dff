// Reads pose, walls and obstacles out of the simulation's structs.
// Layer: web/robot, pure. Source: experimental.simulatedcreate. Units: metres, radians.

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

/** A pose from a struct with x, y and heading; null when there is none. */
export function poseOf(value: unknown): Pose | null {
  const { x, y, heading } = (value ?? {}) as Record<string, unknown>;
  const pose = [x, y, heading].map(numberOf);
  if (pose.includes(null)) return null;
  const [a = 0, b = 0, theta = 0] = pose as number[];
  return { x: a, y: b, theta };
}

/** A list of structs with x1, y1, x2, y2; what is something else is left out. */
export function wallsOf(value: unknown): Wall[] {
  if (!Array.isArray(value)) return [];
  return value.flatMap((item) => {
    const { x1, y1, x2, y2 } = (item ?? {}) as Record<string, unknown>;
    const wall = [x1, y1, x2, y2].map(numberOf);
    if (wall.includes(null)) return [];
    const [a = 0, b = 0, c = 0, d = 0] = wall as number[];
    return [{ x1: a, y1: b, x2: c, y2: d }];
  });
}

/** A list of structs with x, y and radius; what is something else is left out. */
export function obstaclesOf(value: unknown): Obstacle[] {
  if (!Array.isArray(value)) return [];
  return value.flatMap((item) => {
    const { x, y, radius } = (item ?? {}) as Record<string, unknown>;
    const circle = [x, y, radius].map(numberOf);
    if (circle.includes(null)) return [];
    const [a = 0, b = 0, r = 0] = circle as number[];
    return [{ x: a, y: b, radius: r }];
  });
}

/**
 * Walls that join end to end and come back to where they began, as corners; and the walls that do not.
 * Walls of one loop follow each other in the list.
 */
export function loopsOf(walls: readonly Wall[]): { loops: { x: number; y: number }[][]; open: Wall[] } {
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

function numberOf(value: unknown): number | null {
  return typeof value === "number" && Number.isFinite(value) ? value : null;
}
