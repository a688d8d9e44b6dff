// From sticks, keys and a gamepad to what is sent: axes from -1 to 1, each to a number of a call's arguments or of a value.
// Layer: web/panels, pure. Gamepads: the standard mapping of the Gamepad API, where up is negative.

import type { Settings } from "../board/board";
import { DRIVE_TIMEOUT_MS } from "../robot/driver";
import type { Member, Remote } from "../robot/remote";
import { makeDraft, valueOf } from "../values/draft";
import type { Draft } from "../values/draft";
import type { Definitions } from "../values/definitions";
import { stepsOf } from "../values/paths";

export const STICKS = ["left-x", "left-y", "right-x", "right-y"] as const;
/** Right and up are positive. */
export type Stick = (typeof STICKS)[number];
export type Deflection = Readonly<Record<Stick, number>>;

export const AT_REST: Deflection = { "left-x": 0, "left-y": 0, "right-x": 0, "right-y": 0 };

/** By `KeyboardEvent.code`: W, A, S and D are the left stick, the arrows the right one. */
const KEYS: Readonly<Record<string, readonly [Stick, number]>> = {
  KeyA: ["left-x", -1],
  KeyD: ["left-x", 1],
  KeyS: ["left-y", -1],
  KeyW: ["left-y", 1],
  ArrowLeft: ["right-x", -1],
  ArrowRight: ["right-x", 1],
  ArrowDown: ["right-y", -1],
  ArrowUp: ["right-y", 1],
};

export function isStickKey(code: string): boolean {
  return Object.hasOwn(KEYS, code);
}

export function deflectionOfKeys(held: ReadonlySet<string>): Deflection {
  const sum = { ...AT_REST };
  for (const code of held) {
    const key = Object.hasOwn(KEYS, code) ? KEYS[code] : undefined;
    if (key) sum[key[0]] += key[1];
  }
  return sum;
}

/**
 * The axes of the first gamepad that is known to have the standard mapping: of another, an axis may be a trigger that rests at -1.
 * `ignored`: the name of such a one, where there is no better.
 */
export function findGamepad(pads: readonly (Gamepad | null)[]): { axes: readonly number[] | null; ignored: string } {
  const connected = pads.filter((pad): pad is Gamepad => pad?.connected === true);
  const axes = connected.find(({ mapping }) => mapping === "standard")?.axes ?? null;
  return { axes, ignored: axes === null ? (connected[0]?.id ?? "") : "" };
}

export function deflectionOfGamepad(axes: readonly number[]): Deflection {
  const at = (i: number): number => (Number.isFinite(axes[i]) ? (axes[i] as number) : 0);
  return { "left-x": at(0), "left-y": -at(1), "right-x": at(2), "right-y": -at(3) };
}

/** Of all that is held at a time; at most full. */
export function together(...all: readonly Deflection[]): Deflection {
  const sum = { ...AT_REST };
  for (const stick of STICKS) {
    const total = all.reduce((value, each) => value + each[stick], 0);
    sum[stick] = Math.min(1, Math.max(-1, total));
  }
  return sum;
}

/** What one stick's direction does. */
export interface Axis {
  stick: Stick;
  /** The number that it sets: a parameter, `velocity[0]`, `twist.linear.x`. */
  path: string;
  /** Added at full deflection. */
  scale: number;
  /** A deflection that does nothing yet, 0 to 0.9. */
  deadZone: number;
}

export interface Mapping {
  axes: readonly Axis[];
  /** What is sent at rest, one for each parameter. */
  neutral: readonly Draft[];
}

export interface Input {
  name: string;
  type: string;
}

/** Settings may come from a file: what is no axis is left out. */
export function readAxes(settings: Settings): Axis[] {
  const given = Object.hasOwn(settings, "axes") ? settings["axes"] : undefined;
  if (!Array.isArray(given)) return [];
  return given.flatMap((each: unknown): Axis[] => {
    if (each === null || typeof each !== "object") return [];
    const { stick, path, scale, deadZone } = each as Record<string, unknown>;
    const known = STICKS.find((name) => name === stick);
    if (!known || typeof path !== "string") return [];
    const zone = typeof deadZone === "number" && deadZone >= 0 ? Math.min(deadZone, 0.9) : 0.1;
    return [
      { stick: known, path, scale: typeof scale === "number" && Number.isFinite(scale) ? scale : 1, deadZone: zone },
    ];
  });
}

/** The texts of the neutral value, by the names of the parameters; what the settings don't have is empty. */
export function readNeutral(
  settings: Settings,
  inputs: readonly Input[],
  definitions: Definitions,
  scope: string,
): Draft[] {
  const given = Object.hasOwn(settings, "neutral") ? settings["neutral"] : undefined;
  return inputs.map(({ name, type }, i) => {
    const empty = makeDraft(type, definitions, scope);
    const text = child(given, Array.isArray(given) ? i : name); // an older board has a list, in the order that they had
    return empty.kind === "text" && typeof text === "string" ? { kind: "text", text } : empty;
  });
}

/** As it is kept in the settings. */
export function neutralTexts(neutral: readonly Draft[], inputs: readonly Input[]): Record<string, string> {
  return Object.fromEntries(
    inputs.flatMap(({ name }, i) => {
      const draft = neutral[i];
      return draft?.kind === "text" ? [[name, draft.text]] : [];
    }),
  );
}

/** The part of a deflection that these axes are about: other sticks are those of other members. */
export function partFor(axes: readonly Axis[], deflection: Deflection): Deflection {
  const part = { ...AT_REST };
  for (const { stick } of axes) part[stick] = deflection[stick];
  return STICKS.every((stick) => part[stick] === 0) ? AT_REST : part;
}

/** What `axis` is worth at a deflection: nothing in the dead zone, from there evenly to the scale. */
export function worthOf(axis: Axis, deflection: Deflection): number {
  const given = deflection[axis.stick];
  const beyond = Math.max(0, Math.abs(given) - axis.deadZone) / (1 - axis.deadZone);
  return Math.sign(given) * beyond * axis.scale;
}

/**
 * The arguments, or the one value of a wire or property.
 * @throws Error with the path that leads to no number, or what is wrong with the neutral value.
 */
export function commandOf(
  { axes, neutral }: Mapping,
  inputs: readonly Input[],
  deflection: Deflection,
  definitions: Definitions,
  scope: string,
): unknown[] {
  const values = inputs.map(({ type }, i) =>
    valueOf(neutral[i] ?? makeDraft(type, definitions, scope), type, definitions, scope),
  );
  for (const axis of axes) add(values, inputs, axis.path, worthOf(axis, deflection));
  return values;
}

/**
 * What one member is told. At rest no axis counts, and the neutral value is that of when moving began: what is typed meanwhile
 * never keeps it from stopping.
 */
export class Commands {
  #rest: unknown[] | null = null;
  #isMoving = false;

  /** @throws Error as commandOf(); at rest only where no neutral value was valid yet. */
  of(
    mapping: Mapping,
    inputs: readonly Input[],
    deflection: Deflection,
    definitions: Definitions,
    scope: string,
  ): unknown[] {
    const rest = (): unknown[] => commandOf({ ...mapping, axes: [] }, inputs, AT_REST, definitions, scope);
    if (deflection !== AT_REST) {
      const command = commandOf(mapping, inputs, deflection, definitions, scope);
      if (!this.#isMoving) this.#rest = rest();
      this.#isMoving = true;
      return command;
    }
    try {
      if (!this.#isMoving) this.#rest = rest();
    } catch (error) {
      if (this.#rest === null) throw error;
    }
    this.#isMoving = false;
    return (this.#rest ??= rest());
  }
}

/** At rest past whatever waits to be sent. Settles when the device has answered, or after DRIVE_TIMEOUT_MS. */
export function tell(
  object: Target,
  { kind, name }: Member,
  given: readonly unknown[],
  isRest: boolean,
): Promise<unknown> {
  const options = { timeout: DRIVE_TIMEOUT_MS };
  if (kind === "function") return object[isRest ? "urgent" : "call"](name, given, options);
  if (isRest) return object.setNow(name, given[0], options);
  return object[kind === "wire" ? "poke" : "set"](name, given[0], options);
}

type Target = Pick<Remote, "call" | "urgent" | "set" | "setNow" | "poke">;

/** By the path's first step the parameter; a wire's value has no name, so its own name may be left out. */
function add(values: unknown[], inputs: readonly Input[], path: string, worth: number): void {
  const [first, ...rest] = stepsOf(path);
  const index = inputs.findIndex(({ name }) => name === first);
  const steps = index >= 0 ? [index, ...rest] : inputs.length === 1 ? [0, ...stepsOf(path)] : [];
  let at: unknown = values;
  for (const step of steps.slice(0, -1)) at = child(at, step);
  const last = steps.at(-1);
  const before = last === undefined ? undefined : child(at, last);
  if (last === undefined || (typeof before !== "number" && typeof before !== "bigint"))
    throw new Error(`"${path}" is no number of ${inputs.map(({ name, type }) => `${type} ${name}`).join(", ")}`);
  const of = at as Record<string | number, unknown>;
  const isWhole = /^u?int\d/.test(inputs[Number(steps[0])]?.type ?? "") || typeof before === "bigint";
  const sum = Number(before) + worth;
  of[last] = typeof before === "bigint" ? BigInt(Math.round(sum)) : isWhole ? Math.round(sum) : sum;
}

function child(of: unknown, step: string | number): unknown {
  return of !== null && typeof of === "object" && Object.hasOwn(of, step)
    ? (of as Record<string | number, unknown>)[step]
    : undefined;
}
