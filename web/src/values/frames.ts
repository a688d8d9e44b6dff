// Poses inside a value, and where the links of a standard robot are. Layer: web/values, pure.
// Source: com.robotraconteur.geometry (Pose, Transform, NamedPose, NamedTransform, Pose2D), com.robotraconteur.robotics.robot
// (RobotKinChainInfo: H the axes of the joints, P from each joint to the next, in the base's frame while all joints are at 0).

export type Vector = readonly [x: number, y: number, z: number];
export type Turn = readonly [w: number, x: number, y: number, z: number];

/** Metres; the turn has length 1. */
export interface Pose {
  at: Vector;
  turn: Turn;
}

export interface Frame {
  name: string;
  pose: Pose;
}

export const ORIGIN: Pose = { at: [0, 0, 0], turn: [1, 0, 0, 0] };

const MOST_FRAMES = 200;
const MOST_ITEMS = 100;
const MOST_DEPTH = 6;

/** All poses of a value, named by themselves or else by their path; those that name a parent that is there stand in its frame. */
export function framesIn(value: unknown): Frame[] {
  const found: Found[] = [];
  collect(value, "", found, 0);
  const byName = new Map(found.map((each) => [each.name, each]));
  return found.map((each) => ({ name: each.name, pose: fromBase(each, byName) }));
}

interface Found extends Frame {
  parent: string;
}

function fromBase(found: Found, byName: ReadonlyMap<string, Found>): Pose {
  const seen = new Set([found]);
  let { pose } = found;
  for (let at = byName.get(found.parent); at && !seen.has(at); at = byName.get(at.parent)) {
    seen.add(at);
    pose = compose(at.pose, pose);
  }
  return pose;
}

function collect(value: unknown, path: string, found: Found[], depth: number): void {
  if (found.length >= MOST_FRAMES || depth > MOST_DEPTH || !isObject(value) || ArrayBuffer.isView(value)) return;
  const pose = readPose(value);
  if (pose) {
    found.push({ name: path, parent: "", pose });
    return;
  }
  const named = readPose(own(value, "pose")) ?? readPose(own(value, "transform"));
  const name = nameOf(own(value, "frame")) || nameOf(own(value, "child_frame"));
  if (named && name !== "") {
    found.push({ name, parent: nameOf(own(value, "parent_frame")), pose: named });
    return;
  }
  const entries = value instanceof Map ? [...(value as Map<unknown, unknown>)] : Object.entries(value);
  for (const [key, item] of entries.slice(0, MOST_ITEMS)) {
    const isField = !Array.isArray(value) && !(value instanceof Map);
    const step = isField ? (path === "" ? "" : ".") + String(key) : `[${String(key)}]`;
    collect(item, path + step, found, depth + 1);
  }
}

/** undefined: no pose, or one with numbers that are none. */
export function readPose(value: unknown): Pose | undefined {
  if (!isObject(value)) return undefined;
  const at = readVector(own(value, "position") ?? own(value, "translation"));
  if (!at) return undefined;
  const turned = own(value, "orientation") ?? own(value, "rotation");
  if (typeof turned === "number") return Number.isFinite(turned) ? { at, turn: about([0, 0, 1], turned) } : undefined;
  const turn = readTurn(turned);
  return turn && { at, turn };
}

function readTurn(value: unknown): Turn | undefined {
  if (!isObject(value)) return undefined;
  const parts = ["w", "x", "y", "z"].map((part) => own(value, part));
  if (!parts.every((part) => typeof part === "number")) return undefined;
  const [w = 0, x = 0, y = 0, z = 0] = parts;
  const length = Math.hypot(w, x, y, z);
  if (length === 0) return ORIGIN.turn; // what nobody has filled in
  return Number.isFinite(length) ? [w / length, x / length, y / length, z / length] : undefined;
}

/** Two dimensions lie in the plane z = 0. */
function readVector(value: unknown): Vector | undefined {
  if (!isObject(value)) return undefined;
  const [x, y, z = 0] = ["x", "y", "z"].map((part) => own(value, part));
  const isVector = typeof x === "number" && typeof y === "number" && typeof z === "number";
  return isVector && Number.isFinite(x + y + z) ? [x, y, z] : undefined;
}

export interface Chain {
  name: string;
  joints: readonly ChainJoint[];
  /** From each joint to the next; one more than there are joints. */
  offsets: readonly Vector[];
  /** In the frame after the last joint. */
  flange: Pose;
}

interface ChainJoint {
  axis: Vector;
  /** Which of the robot's joints it is. */
  number: number;
  slides: boolean;
  /** From the robot's unit to radians or metres. */
  scale: number;
}

const PRISMATIC = 3; // JointType
const DEGREE = 3; // JointPositionUnits

/** The chains of a RobotInfo; those whose lists don't fit together are left out. */
export function chainsOf(info: unknown): Chain[] {
  const joints = listOf(info, "joint_info");
  return listOf(info, "chains").flatMap((chain, i) => {
    const axes = listOf(chain, "H").map(readVector);
    const offsets = listOf(chain, "P").map(readVector);
    if (!axes.every(isThere) || !offsets.every(isThere) || axes.length === 0 || offsets.length !== axes.length + 1)
      return [];
    const given = isObject(chain) ? own(chain, "joint_numbers") : undefined;
    const numbers = ArrayBuffer.isView(given) ? Array.from(given as Uint32Array) : [];
    return {
      name: nameOf(isObject(chain) ? own(chain, "kin_chain_identifier") : null) || `chains[${i}]`,
      joints: axes.map((axis, k) => {
        const number = numbers[k] ?? k;
        const joint = joints[number];
        const has = (field: string, value: number): boolean => isObject(joint) && own(joint, field) === value;
        const scale = has("default_units", DEGREE) ? Math.PI / 180 : 1;
        return { axis, number, slides: has("joint_type", PRISMATIC), scale };
      }),
      offsets,
      flange: readPose(isObject(chain) ? own(chain, "flange_pose") : null) ?? ORIGIN,
    };
  });
}

/** The base, each joint as the links before it carry it, and the flange last. */
export function posesOf(chain: Chain, positions: ArrayLike<number>): Pose[] {
  let pose = ORIGIN;
  const poses = [pose];
  chain.joints.forEach(({ axis, number, slides, scale }, i) => {
    const by = (positions[number] ?? 0) * scale;
    pose = compose(pose, { at: chain.offsets[i] ?? [0, 0, 0], turn: ORIGIN.turn });
    poses.push(pose);
    const slid: Vector = [axis[0] * by, axis[1] * by, axis[2] * by];
    pose = compose(pose, slides ? { at: slid, turn: ORIGIN.turn } : { at: [0, 0, 0], turn: about(axis, by) });
  });
  pose = compose(pose, { at: chain.offsets.at(-1) ?? [0, 0, 0], turn: ORIGIN.turn });
  poses.push(compose(pose, chain.flange));
  return poses;
}

/** `inner`, which is told in `outer`. */
export function compose(outer: Pose, inner: Pose): Pose {
  const [x, y, z] = rotate(outer.turn, inner.at);
  return { at: [outer.at[0] + x, outer.at[1] + y, outer.at[2] + z], turn: multiply(outer.turn, inner.turn) };
}

function rotate(turn: Turn, [x, y, z]: Vector): Vector {
  const [w, i, j, k] = turn;
  const [, a, b, c] = multiply(multiply(turn, [0, x, y, z]), [w, -i, -j, -k]);
  return [a, b, c];
}

function multiply([a, b, c, d]: Turn, [e, f, g, h]: Turn): Turn {
  return [
    a * e - b * f - c * g - d * h,
    a * f + b * e + c * h - d * g,
    a * g - b * h + c * e + d * f,
    a * h + b * g - c * f + d * e,
  ];
}

export function about([x, y, z]: Vector, angle: number): Turn {
  const length = Math.hypot(x, y, z) || 1;
  const part = Math.sin(angle / 2) / length;
  return [Math.cos(angle / 2), x * part, y * part, z * part];
}

function nameOf(identifier: unknown): string {
  const name = isObject(identifier) ? own(identifier, "name") : undefined;
  return typeof name === "string" ? name : "";
}

function listOf(value: unknown, field: string): unknown[] {
  const list = isObject(value) ? own(value, field) : undefined;
  return Array.isArray(list) ? list.slice(0, MOST_ITEMS) : [];
}

const isObject = (value: unknown): value is object => typeof value === "object" && value !== null;
const isThere = <T>(value: T | undefined): value is T => value !== undefined;

function own(value: object, name: string): unknown {
  return Object.hasOwn(value, name) ? (value as Readonly<Record<string, unknown>>)[name] : undefined;
}
