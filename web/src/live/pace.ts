// How often something comes, and whether what came last is old: after three periods, and within a second at most.
// Layer: web/live, pure.

const INTERVALS = 16;
const PERIODS = 3;
const BUNCH_MS = 2;
const SHORTEST_MS = 250; // a hiccup of the page is no old value

export class Pace {
  #heardAt: number | null = null;
  #count = 0;
  #at = 0;
  readonly #intervals: number[] = [];

  /** `now`: milliseconds of a clock that only grows. */
  hear(now: number): void {
    if (this.#heardAt !== null) {
      this.#intervals[this.#at] = now - this.#heardAt;
      this.#at = (this.#at + 1) % INTERVALS;
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

  /**
   * Milliseconds between two, by the middle of the last ones; null before the third. Of those that a busy page hears in bunches, most
   * have no time between them: then on the average.
   */
  get periodMs(): number | null {
    const count = this.#intervals.length;
    if (count < 2) return null;
    const middle = [...this.#intervals].sort((a, b) => a - b)[count >> 1] ?? 0;
    return middle >= BUNCH_MS ? middle : this.#intervals.reduce((sum, each) => sum + each, 0) / count;
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

  /** A second. */
  rate(now: number): number {
    const period = this.periodMs;
    return period === null || this.isStale(now) ? 0 : 1000 / Math.max(period, 1);
  }
}
