// Keeps one service connected until disposed, by a subscription of the client library, and says what is going on meanwhile.
// Layer: web/robot.

import { subscribe } from "rrgate-client";
import type { RemoteObject, UrlSource } from "rrgate-client";
import { Store } from "../app/store";
import type { Control } from "./control";
import { OwnLocks } from "./own_locks";
import { explain, remoteOf } from "./remote";
import type { Remote } from "./remote";

export type LinkState =
  | { kind: "connecting" }
  | { kind: "online"; since: number; remote: Remote }
  /**
   * Not connected. `since`: when it was lost (or first failed); `retryAt`: when the attempt begins that comes or runs.
   * `remote`: of the connection where that is still open, and only the device is said to be away: a stop still goes by it.
   */
  | { kind: "lost"; since: number; reason: string; retryAt: number; remote: Remote | null };

/** What an open connection leads to, also to a device that is said to be away. */
export function openIn(state: LinkState): Remote | null {
  return state.kind === "connecting" ? null : state.remote;
}

const LIMITS = { timeout: 10_000, longestRetry: 10_000 };

export class Link {
  readonly state = new Store<LinkState>({ kind: "connecting" });
  readonly #subscription;
  readonly #controls = new Map<string, Control>();
  #locks = new OwnLocks();
  #client: RemoteObject | null = null;

  /** Starts connecting at once. `device`: whose service it is. `follow`: for tests. */
  constructor(
    url: string | UrlSource,
    private readonly device: string,
    follow: typeof subscribe = subscribe,
  ) {
    this.#subscription = follow(url, LIMITS);
    this.#subscription.onConnected((client) => {
      this.#client = client;
      this.#locks = new OwnLocks(); // those from before ended with their session
      this.#connect(client);
    });
    this.#subscription.onLost((reason) => this.#lose(explain(reason), null));
    this.#subscription.onFailed((error) => this.#lose(explain(error), null));
    this.#subscription.onWaiting((ms) => this.#putOff(Date.now() + ms));
  }

  /**
   * What the gateway says of the device: it keeps the sessions of a shared one while that is away. `reason`: why it is; null: it is
   * there.
   */
  setAway(reason: string | null): void {
    const { value } = this.state;
    if (reason !== null && value.kind === "online") this.#lose(reason, value.remote);
    else if (reason === null && value.kind === "lost" && value.remote && this.#client) this.#connect(this.#client);
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
    const remote = remoteOf(client, this.device, this.#controls, this.#locks);
    this.state.value = { kind: "online", since: Date.now(), remote };
  }

  /** Rights to command are lost before anybody hears of it: who had them takes them again by hand. */
  #lose(reason: string, remote: Remote | null): void {
    for (const control of this.#controls.values()) control.end(reason);
    const before = this.state.value;
    const since = before.kind === "lost" ? before.since : Date.now();
    this.state.value = { kind: "lost", since, reason, retryAt: Date.now(), remote };
  }

  #putOff(retryAt: number): void {
    if (this.state.value.kind === "lost") this.state.value = { ...this.state.value, retryAt };
  }
}
