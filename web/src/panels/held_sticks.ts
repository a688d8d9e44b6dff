// What moves the sticks of a teleop panel: keys, fingers on the screen, a gamepad. Letting go is for good: a finger or a key
// drives again from a new press on, an axis of a gamepad once it has been in the middle. Layer: web/panels, pure.

import { AT_REST, deflectionOfGamepad, deflectionOfKeys, STICKS, together } from "./teleop";
import type { Deflection, Stick } from "./teleop";

export type Side = "left" | "right";

export class HeldSticks {
  readonly #keys = new Set<string>();
  readonly #fingers = new Set<Side>();
  #pointers = AT_REST;
  #gamepad = AT_REST;
  /** Axes that may be pushed already, when they are first seen or let go of; with the side they were seen on first. */
  readonly #latched = new Map<Stick, number>();

  constructor() {
    this.#latch();
  }

  get deflection(): Deflection {
    return together(deflectionOfKeys(this.#keys), this.#pointers, this.#gamepad);
  }

  pressKey(code: string): void {
    this.#keys.add(code);
  }

  /** @returns whether it was held. */
  releaseKey(code: string): boolean {
    return this.#keys.delete(code);
  }

  press(side: Side): void {
    this.#fingers.add(side);
  }

  /** @returns whether it counts: not before a press. */
  push(side: Side, x: number, y: number): boolean {
    if (!this.#fingers.has(side)) return false;
    this.#pointers = { ...this.#pointers, [`${side}-x`]: x, [`${side}-y`]: y };
    return true;
  }

  release(side: Side): void {
    this.push(side, 0, 0);
    this.#fingers.delete(side);
  }

  /** `axes`: of the gamepad, null where there is none. `counts`: whether it may drive now. @returns whether it has changed. */
  poll(axes: readonly number[] | null, counts: boolean): boolean {
    const before = this.#gamepad;
    if (axes === null) this.#latch();
    const read = axes === null ? AT_REST : withoutDrift(deflectionOfGamepad(axes));
    const now = { ...AT_REST };
    for (const stick of STICKS) {
      if (axes !== null) this.#unlatch(stick, Math.sign(read[stick]));
      if (counts && !this.#latched.has(stick)) now[stick] = read[stick];
    }
    this.#gamepad = now;
    return STICKS.some((stick) => before[stick] !== now[stick]);
  }

  letGo(): void {
    this.#keys.clear();
    this.#fingers.clear();
    this.#pointers = this.#gamepad = AT_REST;
    this.#latch();
  }

  #latch(): void {
    for (const stick of STICKS) this.#latched.set(stick, 0);
  }

  /** In the middle, or past it: a worn stick may never be read there. */
  #unlatch(stick: Stick, side: number): void {
    const first = this.#latched.get(stick);
    if (first === undefined) return;
    if (side === 0 || side === -first) this.#latched.delete(stick);
    else this.#latched.set(stick, side);
  }
}

/** A stick that nobody touches trembles around 0. Steps of 1/50 keep it from sending each tremble. */
function withoutDrift(deflection: Deflection): Deflection {
  const step = (value: number): number => (Math.abs(value) < 0.05 ? 0 : Math.round(value * 50) / 50);
  return {
    "left-x": step(deflection["left-x"]),
    "left-y": step(deflection["left-y"]),
    "right-x": step(deflection["right-x"]),
    "right-y": step(deflection["right-y"]),
  };
}
