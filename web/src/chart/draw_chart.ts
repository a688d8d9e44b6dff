// Draws the floor like a sea chart: graduated frame, soundings grid, walls as coast, the wake of the robot, rocks where
// it bumped.
// Layer: web/chart. Draws into a 2D context whose unit is the CSS pixel.

import type { Pose } from "../robot/reckoning";
import { loops_of } from "../robot/room";
import type { Room } from "../robot/room";
import type { Point } from "../robot/trail";
import type { Palette } from "./palette";
import { grid_step, to_canvas } from "./view";
import type { View } from "./view";

export interface ChartContent {
  pose: Pose;
  strokes: readonly (readonly Point[])[];
  room: Room;
  bumps: readonly { pose: Pose }[];
  radius_m: number;
  /** Bit 0 right, bit 1 left. */
  bumpers: number;
  /** Whether the pose is current; an old one is drawn hollow. */
  live: boolean;
}

export const FRAME_PX = 26;
const WALL_M = 0.04;

export function draw_chart(ctx: CanvasRenderingContext2D, view: View, content: ChartContent, palette: Palette): void {
  const { left, top, width, height } = view;
  ctx.fillStyle = palette.sea;
  ctx.fillRect(left, top, width, height);
  ctx.save();
  ctx.beginPath();
  ctx.rect(left, top, width, height);
  ctx.clip();
  draw_grid(ctx, view, palette);
  draw_land(ctx, view, content.room, palette);
  draw_wake(ctx, view, content.strokes, palette);
  for (const bump of content.bumps) draw_rock(ctx, view, bump.pose, content.radius_m, palette);
  draw_robot(ctx, view, content, palette);
  ctx.restore();
  draw_frame(ctx, view, palette);
}

function draw_grid(ctx: CanvasRenderingContext2D, view: View, palette: Palette): void {
  const step = grid_step(view.scale);
  ctx.strokeStyle = palette.sea_line;
  ctx.lineWidth = 1;
  ctx.beginPath();
  for (const x of multiples(view.extent.x_min, view.extent.x_max, step)) {
    const [px] = to_canvas(view, x, 0);
    ctx.moveTo(Math.round(px) + 0.5, view.top);
    ctx.lineTo(Math.round(px) + 0.5, view.top + view.height);
  }
  for (const y of multiples(view.extent.y_min, view.extent.y_max, step)) {
    const [, py] = to_canvas(view, 0, y);
    ctx.moveTo(view.left, Math.round(py) + 0.5);
    ctx.lineTo(view.left + view.width, Math.round(py) + 0.5);
  }
  ctx.stroke();
  const [ox, oy] = to_canvas(view, 0, 0); // the start: a small cross
  ctx.strokeStyle = palette.ink_soft;
  ctx.beginPath();
  ctx.moveTo(ox - 6, oy);
  ctx.lineTo(ox + 6, oy);
  ctx.moveTo(ox, oy - 6);
  ctx.lineTo(ox, oy + 6);
  ctx.stroke();
}

/** The largest closed loop of walls is the room: all outside of it is land, and so is the inside of smaller loops. */
function draw_land(ctx: CanvasRenderingContext2D, view: View, room: Room, palette: Palette): void {
  const { loops, open } = loops_of(room.walls);
  loops.sort((a, b) => area_of(b) - area_of(a));
  ctx.lineJoin = "round";
  ctx.lineCap = "round";
  ctx.fillStyle = palette.land;
  ctx.strokeStyle = palette.coast;
  ctx.lineWidth = 1.75;
  ctx.beginPath();
  if (loops.length > 0) ctx.rect(view.left - 4, view.top - 4, view.width + 8, view.height + 8);
  for (const loop of loops) {
    loop.forEach(({ x, y }, i) => {
      if (i === 0) ctx.moveTo(...to_canvas(view, x, y));
      else ctx.lineTo(...to_canvas(view, x, y));
    });
    ctx.closePath();
  }
  ctx.fill("evenodd");
  ctx.stroke();
  for (const { x, y, radius } of room.obstacles) {
    ctx.beginPath();
    ctx.arc(...to_canvas(view, x, y), radius * view.scale, 0, 2 * Math.PI);
    ctx.fill();
    ctx.stroke();
  }
  // Walls that stand free have no inside: a spit of land, coast line first and land over it.
  const thick = Math.max(WALL_M * view.scale, 4);
  for (const [style, width] of [[palette.coast, thick + 3.5], [palette.land, thick]] as const) {
    ctx.strokeStyle = style;
    ctx.lineWidth = width;
    ctx.beginPath();
    for (const wall of open) {
      ctx.moveTo(...to_canvas(view, wall.x1, wall.y1));
      ctx.lineTo(...to_canvas(view, wall.x2, wall.y2));
    }
    ctx.stroke();
  }
}

function area_of(loop: readonly Point[]): number {
  let twice = 0;
  loop.forEach((point, i) => {
    const next = loop[(i + 1) % loop.length] ?? point;
    twice += point.x * next.y - next.x * point.y;
  });
  return Math.abs(twice / 2);
}

function draw_wake(
  ctx: CanvasRenderingContext2D,
  view: View,
  strokes: readonly (readonly Point[])[],
  palette: Palette,
): void {
  ctx.strokeStyle = palette.accent;
  ctx.lineWidth = 2;
  ctx.lineCap = "round";
  ctx.lineJoin = "round";
  for (const stroke of strokes) {
    ctx.beginPath();
    stroke.forEach((point, i) => {
      const at = to_canvas(view, point.x, point.y);
      if (i === 0) ctx.moveTo(...at);
      else ctx.lineTo(...at);
    });
    ctx.stroke();
  }
}

/** The chart sign of a rock awash: a cross with four dots, off the nose of the robot where it touched. */
function draw_rock(ctx: CanvasRenderingContext2D, view: View, pose: Pose, radius_m: number, palette: Palette): void {
  const [x, y] = to_canvas(
    view,
    pose.x + Math.cos(pose.theta) * radius_m,
    pose.y + Math.sin(pose.theta) * radius_m,
  );
  ctx.strokeStyle = ctx.fillStyle = palette.ink;
  ctx.lineWidth = 1.5;
  ctx.beginPath();
  ctx.moveTo(x - 5, y);
  ctx.lineTo(x + 5, y);
  ctx.moveTo(x, y - 5);
  ctx.lineTo(x, y + 5);
  ctx.stroke();
  for (const [dx, dy] of [[-3, -3], [3, -3], [-3, 3], [3, 3]] as const) ctx.fillRect(x + dx - 0.75, y + dy - 0.75, 1.5, 1.5);
}

function draw_robot(ctx: CanvasRenderingContext2D, view: View, content: ChartContent, palette: Palette): void {
  const { pose, bumpers, live, radius_m } = content;
  const radius = Math.max(radius_m * view.scale, 9);
  ctx.save();
  ctx.translate(...to_canvas(view, pose.x, pose.y));
  ctx.rotate(-pose.theta); // canvas y is down: counterclockwise on the floor is negative here
  ctx.beginPath();
  ctx.arc(0, 0, radius, 0, 2 * Math.PI);
  ctx.fillStyle = live ? palette.ink : palette.sea;
  ctx.fill();
  ctx.lineWidth = 2;
  ctx.strokeStyle = live ? palette.sheet : palette.ink;
  ctx.setLineDash(live ? [] : [4, 3]);
  ctx.stroke();
  ctx.setLineDash([]);
  ctx.fillStyle = live ? palette.sheet : palette.ink; // an arrow head: where it looks
  ctx.beginPath();
  ctx.moveTo(radius * 0.62, 0);
  ctx.lineTo(-radius * 0.34, radius * 0.44);
  ctx.lineTo(-radius * 0.1, 0);
  ctx.lineTo(-radius * 0.34, -radius * 0.44);
  ctx.closePath();
  ctx.fill();
  ctx.lineWidth = Math.max(radius * 0.22, 3.5);
  ctx.strokeStyle = palette.accent;
  ctx.lineCap = "butt";
  for (const [bit, from, to] of [[1, 0.08, 1.2], [2, -1.2, -0.08]] as const) {
    if ((bumpers & bit) === 0) continue;
    ctx.beginPath();
    ctx.arc(0, 0, radius + ctx.lineWidth / 2, from, to); // right of the nose is positive with y down
    ctx.stroke();
  }
  ctx.restore();
}

/** The graduated border: bars of half a grid step, black and white in turn, with the metres beside them. */
function draw_frame(ctx: CanvasRenderingContext2D, view: View, palette: Palette): void {
  const { left, top, width, height, extent } = view;
  const step = grid_step(view.scale);
  const bar = 6;
  ctx.fillStyle = palette.sheet;
  ctx.fillRect(left - FRAME_PX, top - FRAME_PX, width + 2 * FRAME_PX, FRAME_PX);
  ctx.fillRect(left - FRAME_PX, top + height, width + 2 * FRAME_PX, FRAME_PX);
  ctx.fillRect(left - FRAME_PX, top, FRAME_PX, height);
  ctx.fillRect(left + width, top, FRAME_PX, height);
  ctx.fillStyle = palette.ink;
  const half = step / 2;
  for (let n = Math.floor(extent.x_min / half); n * half < extent.x_max; n++) {
    if (n % 2 === 0) continue;
    const from = Math.max(to_canvas(view, n * half, 0)[0], left);
    const to = Math.min(to_canvas(view, (n + 1) * half, 0)[0], left + width);
    ctx.fillRect(from, top - bar, to - from, bar);
    ctx.fillRect(from, top + height, to - from, bar);
  }
  for (let n = Math.floor(extent.y_min / half); n * half < extent.y_max; n++) {
    if (n % 2 === 0) continue;
    const from = Math.max(to_canvas(view, 0, (n + 1) * half)[1], top);
    const to = Math.min(to_canvas(view, 0, n * half)[1], top + height);
    ctx.fillRect(left - bar, from, bar, to - from);
    ctx.fillRect(left + width, from, bar, to - from);
  }
  ctx.strokeStyle = palette.ink;
  ctx.lineWidth = 1;
  ctx.strokeRect(left - 0.5, top - 0.5, width + 1, height + 1);
  ctx.strokeRect(left - bar - 0.5, top - bar - 0.5, width + 2 * bar + 1, height + 2 * bar + 1);
  draw_labels(ctx, view, step, bar, palette);
}

function draw_labels(ctx: CanvasRenderingContext2D, view: View, step: number, bar: number, palette: Palette): void {
  const { left, top, width, height, extent } = view;
  const digits = step < 1 ? 1 : 0;
  ctx.fillStyle = palette.ink_soft;
  ctx.font = `11px ${palette.font}`;
  ctx.textAlign = "center";
  ctx.textBaseline = "middle";
  for (const x of multiples(extent.x_min, extent.x_max, step)) {
    const px = to_canvas(view, x, 0)[0];
    if (px < left + 10 || px > left + width - 10) continue;
    ctx.fillText(x.toFixed(digits), px, top + height + bar + 10);
  }
  for (const y of multiples(extent.y_min, extent.y_max, step)) {
    const py = to_canvas(view, 0, y)[1];
    if (py < top + 12 || py > top + height - 12) continue;
    ctx.save();
    ctx.translate(left - bar - 9, py);
    ctx.rotate(-Math.PI / 2);
    ctx.fillText(y.toFixed(digits), 0, 0);
    ctx.restore();
  }
}

function multiples(from: number, to: number, step: number): number[] {
  const found: number[] = [];
  for (let n = Math.ceil(from / step); n * step <= to && found.length < 500; n++) found.push(n * step || 0);
  return found;
}
