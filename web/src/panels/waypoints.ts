// The waypoints of a trajectory as somebody types them, and the closely spaced ones that a robot is given.
// Layer: web/panels, pure. Source: com.robotraconteur.robotics.trajectory; robotraconteur-abstract-robot, which wants at least five
// that are at most 100 ms apart, the first where the robot is.

import { t } from "../app/language";
import type { Settings } from "../board/board";
import type { Joint } from "./joints";

export interface Waypoint {
  /** From the start of the trajectory. */
  seconds: number;
  /** Of each joint, in its unit. */
  positions: readonly number[];
}

const STEP_SECONDS = 0.02; // also at a fifth of the speed not more than 100 ms apart
const SHORTEST_SECONDS = 0.2;
const LONGEST_SECONDS = 600;
export const MOST_WAYPOINTS = 100;

/** As stored, whatever is known of the joints at the moment; filled up with 0 to `count`. */
export function waypointsIn(settings: Settings, count: number): Waypoint[] {
  const found = Object.hasOwn(settings, "waypoints") ? settings["waypoints"] : undefined;
  if (!Array.isArray(found)) return [];
  return found.slice(0, MOST_WAYPOINTS).flatMap((each: unknown) => {
    const { seconds, positions } = (each ?? {}) as Record<string, unknown>;
    if (!isNumber(seconds) || !Array.isArray(positions)) return [];
    const length = Math.max(count, positions.length);
    return [{ seconds, positions: Array.from({ length }, (_, i) => numberOr0(positions[i])) }];
  });
}

/**
 * From where the robot is through all waypoints, with a stop at each.
 * @returns a JointTrajectory. @throws Error with which waypoint cannot be reached, and why.
 */
export function trajectoryThrough(start: ArrayLike<number>, waypoints: readonly Waypoint[], joints: readonly Joint[]) {
  if (waypoints.length === 0) throw new Error(t("There is no waypoint to go to."));
  const points = [makePoint(0, Array.from(start), START)];
  let [from, since] = [Array.from(start), 0];
  waypoints.forEach(({ seconds, positions }, at) => {
    const took = seconds - since;
    check(at + 1, took, seconds, from, positions, joints);
    const steps = Math.ceil(took / STEP_SECONDS - 1e-9);
    const isGoal = at === waypoints.length - 1;
    for (let step = 1; step <= steps; step++) {
      const share = step / steps;
      const eased = share * share * (3 - 2 * share); // begins and ends at rest
      const place = from.map((each, i) => each + ((positions[i] ?? each) - each) * eased);
      points.push(makePoint(since + took * share, place, isGoal && step === steps ? GOAL : PATH));
    }
    [from, since] = [from.map((each, i) => positions[i] ?? each), seconds];
  });
  return { joint_names: joints.map(({ name }) => name), joint_units: [], waypoints: points, extended: new Map() };
}

const START = 1;
const PATH = 2;
const GOAL = 3;

function makePoint(seconds: number, positions: readonly number[], type: number) {
  return {
    joint_position: Float64Array.from(positions),
    joint_velocity: new Float64Array(),
    position_tolerance: new Float64Array(),
    velocity_tolerance: new Float64Array(),
    interpolation_mode: 0,
    waypoint_type: type,
    time_from_start: seconds,
  };
}

function check(
  number: number,
  took: number,
  seconds: number,
  from: readonly number[],
  to: readonly number[],
  joints: readonly Joint[],
): void {
  if (!(took >= SHORTEST_SECONDS))
    throw new Error(t("Waypoint {0} must be at least {1} s after the one before.", number, SHORTEST_SECONDS));
  if (seconds > LONGEST_SECONDS) throw new Error(t("Waypoint {0} is later than {1} s.", number, LONGEST_SECONDS));
  joints.forEach(({ name, low, high, fastest, unit }, i) => {
    const [before, there] = [from[i] ?? 0, to[i] ?? 0];
    if (there < low || there > high)
      throw new Error(
        t("Waypoint {0}: {1} is {2}, its limits are {3} to {4} {5}.", number, name, there, low, high, unit),
      );
    const speed = (1.5 * Math.abs(there - before)) / took; // halfway
    if (speed > fastest)
      throw new Error(
        t(
          "Waypoint {0}: {1} would move at {2} {3}/s, it can move at {4}.",
          number,
          name,
          speed.toFixed(2),
          unit,
          fastest,
        ),
      );
  });
}

function isNumber(value: unknown): value is number {
  return typeof value === "number" && Number.isFinite(value);
}

function numberOr0(value: unknown): number {
  return isNumber(value) ? value : 0;
}
