// What several panels look at: made for the first of them, and ended with the last.
// Layer: web/live.

export interface Made<T> {
  value: T;
  end: () => void;
}

export class Shared<K, T> {
  readonly #entries = new Map<K, Made<T> & { users: number }>();

  /** Joins whoever has it already. `close`: for this user, once, however often it is called. */
  open(key: K, make: () => Made<T>): { value: T; close: () => void } {
    const entry = this.#entries.get(key) ?? { ...make(), users: 0 };
    this.#entries.set(key, entry);
    entry.users += 1;
    let isOpen = true;
    const close = (): void => {
      if (!isOpen) return;
      isOpen = false;
      entry.users -= 1;
      if (entry.users > 0) return;
      this.#entries.delete(key);
      entry.end();
    };
    return { value: entry.value, close };
  }

  /** All that somebody looks at now. */
  get values(): T[] {
    return [...this.#entries.values()].map(({ value }) => value);
  }
}
