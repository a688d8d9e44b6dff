// Time and chance as subscriptions see them; tests bring their own. Layer: wasm-client/ts.
import { after } from "./within.js";

export interface Clock {
  /** Calls `due` once, after so many milliseconds. @returns a function that takes it back. */
  after(milliseconds: number, due: () => void): () => void;
}

export const systemClock: Clock = {
  after(milliseconds, due) {
    const timer = after(milliseconds, due);
    return () => clearTimeout(timer);
  },
};

/** Waits that grow from one failure to the next: twice as long each time, half of it by chance. */
export class Backoff {
  #next: number;

  /** `first`, `longest`: milliseconds; `random`: 0 up to 1. */
  constructor(
    private readonly first: number,
    private readonly longest: number,
    private readonly random: () => number,
  ) {
    this.#next = first;
  }

  /** The next wait in milliseconds, between half of the step and all of it. */
  next(): number {
    const step = this.#next;
    this.#next = Math.min(2 * step, this.longest);
    return step / 2 + (step / 2) * this.random();
  }

  reset(): void {
    this.#next = this.first;
  }
}
