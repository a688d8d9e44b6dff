// Keeps one service connected until disposed, by a subscription of the client library, and says what is going on meanwhile.
// Layer: web/robot.

import { subscribe } from "rrgate-client";
import type { UrlSource } from "rrgate-client";
import { Store } from "../app/store";
import { explain, remoteOf } from "./remote";
import type { Remote } from "./remote";

export type LinkState =
  | { kind: "connecting" }
  | { kind: "online"; since: number; remote: Remote }
  /** Not connected. `since`: when it was lost (or first failed); `retryAt`: when the attempt begins that comes or runs. */
  | { kind: "lost"; since: number; reason: string; retryAt: number };

const LIMITS = { timeout: 10_000, longestRetry: 10_000 };

export class Link {
  readonly state = new Store<LinkState>({ kind: "connecting" });
  readonly #subscription;

  /** Starts connecting at once. `follow`: for tests. */
  constructor(url: string | UrlSource, follow: typeof subscribe = subscribe) {
    this.#subscription = follow(url, LIMITS);
    this.#subscription.onConnected((client) => {
      this.state.value = { kind: "online", since: Date.now(), remote: remoteOf(client) };
    });
    this.#subscription.onLost((reason) => this.#lose(explain(reason)));
    this.#subscription.onFailed((error) => this.#lose(explain(error)));
    this.#subscription.onWaiting((ms) => this.#putOff(Date.now() + ms));
  }

  /** Connects now instead of at the end of the wait; nothing happens while online or connecting. */
  retryNow(): void {
    this.#subscription.retryNow();
    this.#putOff(Date.now());
  }

  dispose(): void {
    void this.#subscription.close();
  }

  #lose(reason: string): void {
    const before = this.state.value;
    const since = before.kind === "lost" ? before.since : Date.now();
    this.state.value = { kind: "lost", since, reason, retryAt: Date.now() };
  }

  #putOff(retryAt: number): void {
    if (this.state.value.kind === "lost") this.state.value = { ...this.state.value, retryAt };
  }
}
