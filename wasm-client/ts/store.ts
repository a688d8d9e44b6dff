// A value that changes, as React, Vue, Svelte and loops take it. Layer: wasm-client/ts.
import { callSafely } from "./errors.js";
import { ValueQueue } from "./members/queue.js";

/**
 * The newest of a value that changes. Both functions may be handed on alone: `useSyncExternalStore(store.subscribe,
 * store.getSnapshot)` in React; to Svelte it is a store as it stands. A loop gets the value there is, then each newest
 * one, until the end.
 */
export interface Store<T> extends AsyncIterable<T> {
  /** The same object until the value changes. */
  readonly getSnapshot: () => T;
  /** Calls `listener` with the value there is, then with each new one. @returns a function that ends it. */
  readonly subscribe: (listener: (value: T) => void) => () => void;
}

export class ValueStore<T> implements Store<T> {
  #value: T;
  #isOver = false;
  readonly #listeners = new Set<(value: T) => void>();
  readonly #loops = new Set<ValueQueue<T>>();

  constructor(value: T) {
    this.#value = value;
  }

  readonly getSnapshot = (): T => this.#value;

  readonly subscribe = (listener: (value: T) => void): (() => void) => {
    const own = (value: T) => listener(value); // twice the same listener is two
    this.#listeners.add(own);
    callSafely(() => own(this.#value));
    return () => void this.#listeners.delete(own);
  };

  set(value: T): void {
    this.#value = value;
    for (const loop of [...this.#loops]) loop.push(value);
    for (const listener of [...this.#listeners]) {
      if (!Object.is(this.#value, value)) return; // one of them has set another, which all have heard of
      callSafely(() => listener(value));
    }
  }

  /** Ends the loops; the value stays. */
  end(): void {
    this.#isOver = true;
    for (const loop of this.#loops) loop.end();
    this.#loops.clear();
  }

  [Symbol.asyncIterator](): AsyncIterator<T, undefined> {
    const loop = new ValueQueue<T>(1, () => void this.#loops.delete(loop));
    loop.push(this.#value);
    if (this.#isOver) loop.end();
    else this.#loops.add(loop);
    return loop;
  }
}
