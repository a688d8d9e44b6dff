// The tools of a standard robot, one at the end of each chain: how fast they may be, and velocities to jog them by.
// Layer: web/panels, pure. Source: com.robotraconteur.robotics.robot, com.robotraconteur.geometry (SpatialVelocity).

import type { Pose, Turn } from "../values/frames";

/** Along an axis of the robot's frame, or about it. */
export const TOOL_AXES = ["X", "Y", "Z", "RX", "RY", "RZ"] as const;
export type ToolAxis = (typeof TOOL_AXES)[number];

export interface Tool {
  name: string;
  /** Whether the robot says that it can be jogged. */
  isJogged: boolean;
  /** By axis: m/s, rad/s. */
  fastest: Readonly<Record<ToolAxis, number>>;
}

type Fields = Readonly<Record<string, unknown>>;
type Point = { x: number; y: number; z: number };

// What ISO 10218-1 calls reduced speed, and as slow a turn: of a robot that says nothing of it.
const REDUCED_M_S = 0.25;
const REDUCED_RAD_S = 0.5;

const JOG_COMMAND = 0x1; // of RobotCapabilities, which has one flag for all kinds of jogging

/** Of a RobotInfo. */
export function toolsOf(info: unknown): Tool[] {
  const { chains, robot_capabilities: capabilities } = fieldsOf(info);
  if (!Array.isArray(chains)) return [];
  return chains.map((each: unknown, i) => {
    const chain = fieldsOf(each);
    const { name } = fieldsOf(chain["kin_chain_identifier"]);
    const fastest = (axis: ToolAxis): number =>
      speedIn(chain["tcp_reduced_max_velocity"], axis) ||
      speedIn(chain["tcp_max_velocity"], axis) ||
      (isTurn(axis) ? REDUCED_RAD_S : REDUCED_M_S);
    return {
      name: typeof name === "string" && name !== "" ? name : String(i + 1),
      isJogged: (Number(capabilities) & JOG_COMMAND) !== 0,
      fastest: Object.fromEntries(TOOL_AXES.map((axis) => [axis, fastest(axis)])) as Tool["fastest"],
    };
  });
}

/** A SpatialVelocity. */
export function velocityAlong(axis: ToolAxis, speed: number): { angular: Point; linear: Point } {
  const still: Point = { x: 0, y: 0, z: 0 };
  const moved: Point = { ...still, [letterOf(axis)]: speed };
  return isTurn(axis) ? { angular: moved, linear: still } : { angular: still, linear: moved };
}

export function isTurn(axis: ToolAxis): boolean {
  return axis.length === 2;
}

/** Metres along the axis, or degrees about it: roll, pitch and yaw. */
export function coordinateOf({ at, turn }: Pose, axis: ToolAxis): number {
  const i = "xyz".indexOf(letterOf(axis));
  return (isTurn(axis) ? anglesOf(turn) : at)[i] ?? NaN;
}

function anglesOf([w, x, y, z]: Turn): [number, number, number] {
  const degrees = (radians: number): number => (radians * 180) / Math.PI;
  return [
    degrees(Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))),
    degrees(Math.asin(Math.max(-1, Math.min(1, 2 * (w * y - z * x))))),
    degrees(Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))),
  ];
}

function speedIn(velocity: unknown, axis: ToolAxis): number {
  const part = fieldsOf(fieldsOf(velocity)[isTurn(axis) ? "angular" : "linear"]);
  const speed = Math.abs(Number(part[letterOf(axis)]));
  return Number.isFinite(speed) ? speed : 0;
}

function letterOf(axis: ToolAxis): "x" | "y" | "z" {
  return axis.slice(-1).toLowerCase() as "x" | "y" | "z";
}

function fieldsOf(value: unknown): Fields {
  return typeof value === "object" && value !== null ? (value as Fields) : {};
}
