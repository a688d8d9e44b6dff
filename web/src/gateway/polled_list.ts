// A list that the gateway is asked for again every few seconds while it is shown. Layer: web/gateway.

import { Store } from "../app/store";
import { problemOf } from "./answer";
import { Poller, reasonOf } from "./poller";
import { session } from "./session";

export type Polled<T> =
  | { kind: "loading" }
  | { kind: "known"; items: T[] }
  /** The gateway refuses to tell. */
  | { kind: "denied"; reason: string }
  /** It does not answer; `items` are what it said last, null if it never did. */
  | { kind: "away"; since: number; reason: string; items: T[] | null };

export class PolledList<T> {
  readonly state = new Store<Polled<T>>({ kind: "loading" });
  readonly #poller: Poller<Polled<T>>;

  /**
   * @param read The items of an answer. It throws when there is no list: that is not an empty one.
   * @param period Milliseconds.
   */
  constructor(path: string, read: (answer: unknown) => T[], period: number) {
    const ask = async (signal: AbortSignal): Promise<Polled<T>> => {
      const response = await session.fetch(path, { signal });
      if (response.ok) return { kind: "known", items: read(await response.json()) };
      const reason = await problemOf(response);
      if (response.status === 401 || response.status === 403) return { kind: "denied", reason };
      throw new Error(reason);
    };
    this.#poller = new Poller<Polled<T>>({
      ask,
      answered: (next) => (this.state.value = next),
      failed: (error) => (this.state.value = awayAfter(this.state.value, error, Date.now())),
      period,
      hiddenPeriod: null, // nobody looks at a hidden tab
    });
  }

  start(): void {
    this.#poller.start();
  }

  stop(): void {
    this.#poller.stop();
  }
}

/** The state when asking has failed: it keeps what was known. */
export function awayAfter<T>(before: Polled<T>, error: unknown, now: number): Polled<T> {
  return {
    kind: "away",
    since: before.kind === "away" ? before.since : now,
    reason: reasonOf(error),
    items: itemsOf(before),
  };
}

export function itemsOf<T>(state: Polled<T>): T[] | null {
  return state.kind === "known" || state.kind === "away" ? state.items : null;
}
