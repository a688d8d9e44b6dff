// Draws the floor like a sea chart: graduated frame, soundings grid, walls as coast, the wake of the robot, rocks where
// it bumped.
// Layer: web/chart. Draws into a 2D context whose unit is the CSS pixel.

import type { Pose } from "../robot/reckoning";
import { loopsOf } from "../robot/room";
import type { Room } from "../robot/room";
import type { Point } from "../robot/trail";
import type { Palette } from "./palette";
import { gridStep, toCanvas } from "./view";
import type { View } from "./view";

export interface ChartContent {
  pose: Pose;
  strokes: readonly (readonly Point[])[];
  room: Room;
  bumps: readonly { pose: Pose }[];
  radiusM: number;
  /** Bit 0 right, bit 1 left. */
  bumpers: number;
  /** Whether the pose is current; an old one is drawn hollow. */
  live: boolean;
}

export const FRAME_PX = 26;
const WALL_M = 0.04;

export function drawChart(ctx: CanvasRenderingContext2D, view: View, content: ChartContent, palette: Palette): void {
  const { left, top, width, height } = view;
  ctx.fillStyle = palette.sea;
  ctx.fillRect(left, top, width, height);
  ctx.save();
  ctx.beginPath();
  ctx.rect(left, top, width, height);
  ctx.clip();
  drawGrid(ctx, view, palette);
  drawLand(ctx, view, content.room, palette);
  drawWake(ctx, view, content.strokes, palette);
  for (const bump of content.bumps) drawRock(ctx, view, bump.pose, content.radiusM, palette);
  drawRobot(ctx, view, content, palette);
  ctx.restore();
  drawFrame(ctx, view, palette);
}

function drawGrid(ctx: CanvasRenderingContext2D, view: View, palette: Palette): void {
  const step = gridStep(view.scale);
  ctx.strokeStyle = palette.seaLine;
  ctx.lineWidth = 1;
  ctx.beginPath();
  for (const x of multiples(view.extent.xMin, view.extent.xMax, step)) {
    const [px] = toCanvas(view, x, 0);
    ctx.moveTo(Math.round(px) + 0.5, view.top);
    ctx.lineTo(Math.round(px) + 0.5, view.top + view.height);
  }
  for (const y of multiples(view.extent.yMin, view.extent.yMax, step)) {
    const [, py] = toCanvas(view, 0, y);
    ctx.moveTo(view.left, Math.round(py) + 0.5);
    ctx.lineTo(view.left + view.width, Math.round(py) + 0.5);
  }
  ctx.stroke();
  const [ox, oy] = toCanvas(view, 0, 0); // the start: a small cross
  ctx.strokeStyle = palette.inkSoft;
  ctx.beginPath();
  ctx.moveTo(ox - 6, oy);
  ctx.lineTo(ox + 6, oy);
  ctx.moveTo(ox, oy - 6);
  ctx.lineTo(ox, oy + 6);
  ctx.stroke();
}

/** The largest closed loop of walls is the room: all outside of it is land, and so is the inside of smaller loops. */
function drawLand(ctx: CanvasRenderingContext2D, view: View, room: Room, palette: Palette): void {
  const { loops, open } = loopsOf(room.walls);
  loops.sort((a, b) => areaOf(b) - areaOf(a));
  ctx.lineJoin = "round";
  ctx.lineCap = "round";
  ctx.fillStyle = palette.land;
  ctx.strokeStyle = palette.coast;
  ctx.lineWidth = 1.75;
  ctx.beginPath();
  if (loops.length > 0) ctx.rect(view.left - 4, view.top - 4, view.width + 8, view.height + 8);
  for (const loop of loops) {
    loop.forEach(({ x, y }, i) => {
      if (i === 0) ctx.moveTo(...toCanvas(view, x, y));
      else ctx.lineTo(...toCanvas(view, x, y));
    });
    ctx.closePath();
  }
  ctx.fill("evenodd");
  ctx.stroke();
  for (const { x, y, radius } of room.obstacles) {
    ctx.beginPath();
    ctx.arc(...toCanvas(view, x, y), radius * view.scale, 0, 2 * Math.PI);
    ctx.fill();
    ctx.stroke();
  }
  // Walls that stand free have no inside: a spit of land, coast line first and land over it.
  const thick = Math.max(WALL_M * view.scale, 4);
  for (const [style, width] of [
    [palette.coast, thick + 3.5],
    [palette.land, thick],
  ] as const) {
    ctx.strokeStyle = style;
    ctx.lineWidth = width;
    ctx.beginPath();
    for (const wall of open) {
      ctx.moveTo(...toCanvas(view, wall.x1, wall.y1));
      ctx.lineTo(...toCanvas(view, wall.x2, wall.y2));
    }
    ctx.stroke();
  }
}

function areaOf(loop: readonly Point[]): number {
  let twice = 0;
  loop.forEach((point, i) => {
    const next = loop[(i + 1) % loop.length] ?? point;
    twice += point.x * next.y - next.x * point.y;
  });
  return Math.abs(twice / 2);
}

function drawWake(
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
      const at = toCanvas(view, point.x, point.y);
      if (i === 0) ctx.moveTo(...at);
      else ctx.lineTo(...at);
    });
    ctx.stroke();
  }
}

/** The chart sign of a rock awash: a cross with four dots, off the nose of the robot where it touched. */
function drawRock(ctx: CanvasRenderingContext2D, view: View, pose: Pose, radiusM: number, palette: Palette): void {
  const [x, y] = toCanvas(view, pose.x + Math.cos(pose.theta) * radiusM, pose.y + Math.sin(pose.theta) * radiusM);
  ctx.strokeStyle = ctx.fillStyle = palette.ink;
  ctx.lineWidth = 1.5;
  ctx.beginPath();
  ctx.moveTo(x - 5, y);
  ctx.lineTo(x + 5, y);
  ctx.moveTo(x, y - 5);
  ctx.lineTo(x, y + 5);
  ctx.stroke();
  for (const [dx, dy] of [
    [-3, -3],
    [3, -3],
    [-3, 3],
    [3, 3],
  ] as const)
    ctx.fillRect(x + dx - 0.75, y + dy - 0.75, 1.5, 1.5);
}

function drawRobot(ctx: CanvasRenderingContext2D, view: View, content: ChartContent, palette: Palette): void {
  const { pose, bumpers, live, radiusM } = content;
  const radius = Math.max(radiusM * view.scale, 9);
  ctx.save();
  ctx.translate(...toCanvas(view, pose.x, pose.y));
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
  for (const [bit, from, to] of [
    [1, 0.08, 1.2],
    [2, -1.2, -0.08],
  ] as const) {
    if ((bumpers & bit) === 0) continue;
    ctx.beginPath();
    ctx.arc(0, 0, radius + ctx.lineWidth / 2, from, to); // right of the nose is positive with y down
    ctx.stroke();
  }
  ctx.restore();
}

/** The graduated border: bars of half a grid step, black and white in turn, with the metres beside them. */
function drawFrame(ctx: CanvasRenderingContext2D, view: View, palette: Palette): void {
  const { left, top, width, height, extent } = view;
  const step = gridStep(view.scale);
  const bar = 6;
  ctx.fillStyle = palette.sheet;
  ctx.fillRect(left - FRAME_PX, top - FRAME_PX, width + 2 * FRAME_PX, FRAME_PX);
  ctx.fillRect(left - FRAME_PX, top + height, width + 2 * FRAME_PX, FRAME_PX);
  ctx.fillRect(left - FRAME_PX, top, FRAME_PX, height);
  ctx.fillRect(left + width, top, FRAME_PX, height);
  ctx.fillStyle = palette.ink;
  const half = step / 2;
  for (let n = Math.floor(extent.xMin / half); n * half < extent.xMax; n++) {
    if (n % 2 === 0) continue;
    const from = Math.max(toCanvas(view, n * half, 0)[0], left);
    const to = Math.min(toCanvas(view, (n + 1) * half, 0)[0], left + width);
    ctx.fillRect(from, top - bar, to - from, bar);
    ctx.fillRect(from, top + height, to - from, bar);
  }
  for (let n = Math.floor(extent.yMin / half); n * half < extent.yMax; n++) {
    if (n % 2 === 0) continue;
    const from = Math.max(toCanvas(view, 0, (n + 1) * half)[1], top);
    const to = Math.min(toCanvas(view, 0, n * half)[1], top + height);
    ctx.fillRect(left - bar, from, bar, to - from);
    ctx.fillRect(left + width, from, bar, to - from);
  }
  ctx.strokeStyle = palette.ink;
  ctx.lineWidth = 1;
  ctx.strokeRect(left - 0.5, top - 0.5, width + 1, height + 1);
  ctx.strokeRect(left - bar - 0.5, top - bar - 0.5, width + 2 * bar + 1, height + 2 * bar + 1);
  drawLabels(ctx, view, step, bar, palette);
}

function drawLabels(ctx: CanvasRenderingContext2D, view: View, step: number, bar: number, palette: Palette): void {
  const { left, top, width, height, extent } = view;
  const digits = step < 1 ? 1 : 0;
  ctx.fillStyle = palette.inkSoft;
  ctx.font = `11px ${palette.font}`;
  ctx.textAlign = "center";
  ctx.textBaseline = "middle";
  for (const x of multiples(extent.xMin, extent.xMax, step)) {
    const px = toCanvas(view, x, 0)[0];
    if (px < left + 10 || px > left + width - 10) continue;
    ctx.fillText(x.toFixed(digits), px, top + height + bar + 10);
  }
  for (const y of multiples(extent.yMin, extent.yMax, step)) {
    const py = toCanvas(view, 0, y)[1];
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
