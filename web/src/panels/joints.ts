// What a standard robot says of itself, in words and limits.
// Layer: web/panels, pure. Source: com.robotraconteur.robotics.robot, .joints.

import { enumName, flagNames } from "../values/definitions";
import type { Definitions } from "../values/definitions";
import { readPose } from "../values/frames";
import type { Pose } from "../values/frames";

export interface RobotState {
  commandMode: number;
  operationalMode: number;
  controllerState: number;
  flags: bigint | number;
  positions: Float64Array;
  /** Of the tool of each chain, in the robot's frame; undefined where that is no pose. */
  tools: readonly (Pose | undefined)[];
}

/** undefined: nothing came yet. */
export function readState(value: unknown): RobotState | undefined {
  if (value === null || typeof value !== "object") return undefined;
  const state = value as Fields;
  const { robot_state_flags: flags, joint_position: positions, kin_chain_tcp: tools } = state;
  return {
    commandMode: Number(state["command_mode"]),
    operationalMode: Number(state["operational_mode"]),
    controllerState: Number(state["controller_state"]),
    flags: typeof flags === "bigint" ? flags : Number(flags),
    positions: positions instanceof Float64Array ? positions : new Float64Array(),
    tools: Array.isArray(tools) ? tools.map(readPose) : [],
  };
}

type Fields = Readonly<Record<string, unknown>>;

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
  const { joint_info: joints } = (info ?? {}) as Fields;
  if (!Array.isArray(joints)) return [];
  return joints.map((each: unknown, i) => {
    const { joint_identifier: id, joint_limits: limits, default_units: unit } = (each ?? {}) as Fields;
    const { name } = (id ?? {}) as Fields;
    const { lower, upper, velocity, reduced_velocity: reduced } = (limits ?? {}) as Fields;
    return {
      name: typeof name === "string" && name !== "" ? name : `joint ${i + 1}`,
      unit: UNITS[Number(unit)] ?? "",
      low: Number(lower),
      high: Number(upper),
      fastest: Number(reduced) || Number(velocity) || 1,
    };
  });
}

export type WordKind = "good" | "bad" | "plain";

const BAD = /error|estop|failure|guard|required/;
const GOOD = /^(ready|enabled|homed)$/;

/** Modes first, then the flags that are set; "estop_button1" as "estop button1". */
export function stateWords(
  state: RobotState | undefined,
  definitions: Definitions,
  scope: string,
): { text: string; kind: WordKind }[] {
  if (!state) return [];
  const flags = definitions.enum("RobotStateFlags", scope);
  const words = [
    modeName(state.commandMode, "RobotCommandMode", definitions, scope),
    modeName(state.operationalMode, "RobotOperationalMode", definitions, scope),
    modeName(state.controllerState, "RobotControllerState", definitions, scope),
    ...(flags ? flagNames(state.flags, flags) : []),
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
