// What stands between a member that gives and a loop that takes. Layer: wasm-client/ts/members.

/** Collects values for one consumer. `limit` 1: only the newest is kept. */
export class ValueQueue<T> implements AsyncIterator<T, undefined> {
  readonly #values: T[] = [];
  readonly #waiting: { resolve(result: IteratorResult<T, undefined>): void; reject(reason: unknown): void }[] = [];
  #end: { error?: unknown } | undefined;

  /** `on_return`: the consumer left its loop. */
  constructor(
    private readonly limit: number,
    private readonly on_return: () => void,
    private readonly on_overflow?: () => unknown,
  ) {}

  push(value: T): void {
    if (this.#end) return;
    const waiting = this.#waiting.shift();
    if (waiting) {
      waiting.resolve({ done: false, value });
      return;
    }
    if (this.#values.length >= this.limit) {
      if (this.on_overflow) return this.fail(this.on_overflow());
      this.#values.shift();
    }
    this.#values.push(value);
  }

  /** What is queued can still be taken; then the loop ends. */
  end(): void {
    this.#finish({});
  }

  /** What is queued can still be taken; then the loop throws, once. */
  fail(error: unknown): void {
    this.#finish({ error });
  }

  next(): Promise<IteratorResult<T, undefined>> {
    if (this.#values.length > 0) return Promise.resolve({ done: false, value: this.#values.shift() as T });
    if (!this.#end) return new Promise((resolve, reject) => this.#waiting.push({ resolve, reject }));
    const end = this.#end;
    this.#end = {};
    return "error" in end ? Promise.reject(end.error) : Promise.resolve({ done: true, value: undefined });
  }

  return(): Promise<IteratorResult<T, undefined>> {
    this.#values.length = 0;
    this.#finish({});
    this.on_return();
    return Promise.resolve({ done: true, value: undefined });
  }

  #finish(end: { error?: unknown }): void {
    if (this.#end) return;
    const [first, ...others] = this.#waiting.splice(0);
    this.#end = first ? {} : end;
    if (first && "error" in end) first.reject(end.error);
    else first?.resolve({ done: true, value: undefined });
    for (const waiting of others) waiting.resolve({ done: true, value: undefined });
  }
}
