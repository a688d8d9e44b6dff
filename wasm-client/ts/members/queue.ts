// What stands between a member that gives and a loop that takes. Layer: wasm-client/ts/members.
import { makeError } from "../errors.js";

/** What may wait for a consumer that says nothing else. */
export const queueLimits = { limit: 10_000, maxBytes: 64 * 1024 * 1024 };

/** Why a loop ends where more waits for it than may. */
export function overflowError(name: string, limit: number, maxBytes: number): Error {
  const what = `more than ${limit} values or ${maxBytes} bytes of ${name} wait`;
  return makeError("OutOfSystemResource", `${what}, and nobody takes them`);
}

/** Collects values for one consumer. `limit` 1: only the newest is kept. */
export class ValueQueue<T> implements AsyncIterator<T, undefined> {
  readonly #values: T[] = [];
  #bytes = 0; // of them, where there is a limit
  readonly #waiting: { resolve(result: IteratorResult<T, undefined>): void; reject(reason: unknown): void }[] = [];
  #end: { error?: unknown } | undefined;

  /**
   * @param onReturn    the consumer left its loop.
   * @param onOverflow  what to fail with where a value is too much; without it the oldest go.
   * @param maxBytes    about as much memory may wait.
   */
  constructor(
    private readonly limit: number,
    private readonly onReturn: () => void,
    private readonly onOverflow?: () => unknown,
    private readonly maxBytes = Infinity,
  ) {}

  push(value: T): void {
    if (this.#end) return;
    const waiting = this.#waiting.shift();
    if (waiting) {
      waiting.resolve({ done: false, value });
      return;
    }
    const size = this.maxBytes === Infinity ? 0 : roughSize(value);
    while (this.#values.length >= this.limit || (this.#bytes > 0 && this.#bytes + size > this.maxBytes)) {
      if (this.onOverflow) return this.fail(this.onOverflow());
      this.#shift();
    }
    this.#bytes += size;
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
    if (this.#values.length > 0) return Promise.resolve({ done: false, value: this.#shift() });
    if (!this.#end) return new Promise((resolve, reject) => this.#waiting.push({ resolve, reject }));
    const end = this.#end;
    this.#end = {};
    return "error" in end ? Promise.reject(end.error) : Promise.resolve({ done: true, value: undefined });
  }

  return(): Promise<IteratorResult<T, undefined>> {
    this.#values.length = 0;
    this.#finish({});
    this.onReturn();
    return Promise.resolve({ done: true, value: undefined });
  }

  #shift(): T {
    const value = this.#values.shift() as T;
    if (this.maxBytes !== Infinity) this.#bytes -= roughSize(value);
    return value;
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

/** About the bytes that a value takes, without its names. Received values are trees: nothing holds itself. */
function roughSize(value: unknown): number {
  if (typeof value === "string") return 2 * value.length;
  if (typeof value !== "object" || value === null) return 8;
  if (ArrayBuffer.isView(value)) return value.byteLength;
  const items = value instanceof Map ? value.values() : Object.values(value);
  let size = 16;
  for (const item of items) size += roughSize(item);
  return size;
}
