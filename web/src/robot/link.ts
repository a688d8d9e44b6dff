// Keeps one service connected until disposed, by a subscription of the client library, and says what is going on meanwhile.
// Layer: web/robot.

import { subscribe } from "rrgate-client";
import type { RemoteObject, UrlSource } from "rrgate-client";
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
  #client: RemoteObject | null = null;
  #isAway = false;

  /** Starts connecting at once. `follow`: for tests. */
  constructor(url: string | UrlSource, follow: typeof subscribe = subscribe) {
    this.#subscription = follow(url, LIMITS);
    this.#subscription.onConnected((client) => {
      this.#client = client;
      this.#isAway = false;
      this.#connect(client);
    });
    this.#subscription.onLost((reason) => {
      this.#client = null;
      this.#lose(explain(reason));
    });
    this.#subscription.onFailed((error) => this.#lose(explain(error)));
    this.#subscription.onWaiting((ms) => this.#putOff(Date.now() + ms));
  }

  /**
   * What the gateway says of the device: it keeps the sessions of a shared one while that is away. `reason`: why it is; null: it is
   * there.
   */
  setAway(reason: string | null): void {
    if (reason !== null && this.state.value.kind === "online") {
      this.#isAway = true;
      this.#lose(reason);
    } else if (reason === null && this.#isAway && this.#client) {
      this.#isAway = false;
      this.#connect(this.#client);
    }
  }

  /** Connects now instead of at the end of the wait; nothing happens while online or connecting. */
  retryNow(): void {
    this.#subscription.retryNow();
    this.#putOff(Date.now());
  }

  dispose(): void {
    void this.#subscription.close();
  }

  /** Anew for those who look: what they had asked the device for is gone. */
  #connect(client: RemoteObject): void {
    this.state.value = { kind: "online", since: Date.now(), remote: remoteOf(client) };
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
