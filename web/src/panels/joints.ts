// What a standard robot says of itself, in words and limits.
// Layer: web/panels, pure. Source: com.robotraconteur.robotics.robot, .joints.

import { enumName, flagNames } from "../values/definitions";
import type { Definitions } from "../values/definitions";

export interface RobotStateValue {
  command_mode: number;
  operational_mode: number;
  controller_state: number;
  robot_state_flags: bigint | number;
  joint_position: Float64Array;
}

export interface Joint {
  name: string;
  unit: string;
  low: number;
  high: number;
  /** Units a second. */
  fastest: number;
}

const UNITS: Readonly<Record<number, string>> = { 1: "m", 2: "rad", 3: "°" };

export function jointsOf(info: unknown): Joint[] {
  const joints = (info as { joint_info?: unknown } | null)?.joint_info;
  if (!Array.isArray(joints)) return [];
  return joints.map((each, i) => {
    const {
      joint_identifier: id,
      joint_limits: limits,
      default_units: unit,
    } = (each ?? {}) as {
      joint_identifier?: { name?: string } | null;
      joint_limits?: { lower?: number; upper?: number; velocity?: number; reduced_velocity?: number } | null;
      default_units?: number;
    };
    return {
      name: id?.name || `joint ${i + 1}`,
      unit: UNITS[unit ?? 0] ?? "",
      low: limits?.lower ?? NaN,
      high: limits?.upper ?? NaN,
      fastest: limits?.reduced_velocity || limits?.velocity || 1,
    };
  });
}

export type WordKind = "good" | "bad" | "plain";

const BAD = /error|estop|failure|guard|required/;
const GOOD = /^(ready|enabled|homed)$/;

/** Modes first, then the flags that are set; "estop_button1" as "estop button1". */
export function stateWords(
  state: RobotStateValue | undefined,
  definitions: Definitions,
  scope: string,
): { text: string; kind: WordKind }[] {
  if (!state) return [];
  const flags = definitions.enum("RobotStateFlags", scope);
  const words = [
    modeName(state.command_mode, "RobotCommandMode", definitions, scope),
    modeName(state.operational_mode, "RobotOperationalMode", definitions, scope),
    modeName(state.controller_state, "RobotControllerState", definitions, scope),
    ...(flags ? flagNames(state.robot_state_flags, flags) : []),
  ];
  return [...new Set(words)]
    .filter((word) => word !== "undefined")
    .map((word) => ({
      text: word.replaceAll("_", " "),
      kind: BAD.test(word) ? "bad" : GOOD.test(word) ? "good" : "plain",
    }));
}

export function modeName(value: number, type: string, definitions: Definitions, scope: string): string {
  const found = definitions.enum(type, scope);
  return (found && enumName(value, found)) ?? String(value);
}
