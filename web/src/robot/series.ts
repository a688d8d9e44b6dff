// The last seconds of one number, for a small plot.
// Layer: web/robot, pure.

export interface Sample {
  /** Milliseconds, any clock that only grows. */
  t: number;
  value: number;
}

export class Series {
  readonly #samples: Sample[] = [];
  readonly #windowMs: number;
  readonly #limit: number;

  /** Keeps `windowMs` of samples, and `limit` of them at most. */
  constructor(windowMs = 30_000, limit = 1200) {
    this.#windowMs = windowMs;
    this.#limit = limit;
  }

  push(t: number, value: number): void {
    if (!Number.isFinite(value)) return;
    this.#samples.push({ t, value });
    let stale = Math.max(0, this.#samples.length - this.#limit);
    while (stale < this.#samples.length - 1 && (this.#samples[stale]?.t ?? t) < t - this.#windowMs) stale++;
    if (stale > 0) this.#samples.splice(0, stale);
  }

  get samples(): readonly Sample[] {
    return this.#samples;
  }

  get newest(): Sample | undefined {
    return this.#samples[this.#samples.length - 1];
  }
}
