// How often something comes, and whether what came last is old: after three periods, and within a second at most.
// Layer: web/live, pure.

import { Rate } from "./rate";

const INTERVALS = 16;
const PERIODS = 3;
const BUNCH_MS = 50; // what a busy page hears late, it hears at once
const SHORTEST_MS = 250; // a hiccup of the page is no old value

export class Pace {
  #heardAt: number | null = null;
  #bunchAt: number | null = null;
  #count = 0;
  #at = 0;
  readonly #intervals: number[] = [];
  readonly #rate = new Rate();

  /** `now`: milliseconds of a clock that only grows. */
  hear(now: number): void {
    this.#rate.hear(now, this.isStale(now));
    if (this.#bunchAt === null || now - this.#bunchAt >= BUNCH_MS) {
      if (this.#bunchAt !== null) {
        this.#intervals[this.#at] = now - this.#bunchAt;
        this.#at = (this.#at + 1) % INTERVALS;
      }
      this.#bunchAt = now;
    }
    this.#heardAt = now;
    this.#count++;
  }

  get count(): number {
    return this.#count;
  }

  get heardAt(): number | null {
    return this.#heardAt;
  }

  /** Milliseconds from bunch to bunch, by the middle of the last ones; null before the third. */
  get periodMs(): number | null {
    const count = this.#intervals.length;
    return count < 2 ? null : ([...this.#intervals].sort((a, b) => a - b)[count >> 1] ?? null);
  }

  ageMs(now: number): number | null {
    return this.#heardAt === null ? null : now - this.#heardAt;
  }

  /** False also for what has no period: it may come only when it changes. */
  isStale(now: number): boolean {
    const period = this.periodMs;
    const age = this.ageMs(now);
    return period !== null && age !== null && age > Math.max(SHORTEST_MS, PERIODS * period);
  }

  /** How many come in a second; 0 where nothing regular comes, and before that is known. */
  rate(now: number): number {
    return this.periodMs === null || this.isStale(now) ? 0 : (this.#rate.perSecond ?? 0);
  }
}
