// Keeps one service connected: reconnects with backoff until disposed, and says what is going on meanwhile.
// Layer: web/robot. Time and the way to connect are given, so that a lost device is tested without one.

import { Store } from "../app/store";
import { backoffMs } from "./backoff";
import { explain } from "./remote";
import type { Remote } from "./remote";

export type LinkState =
  | { kind: "connecting" }
  | { kind: "online"; since: number; remote: Remote }
  /** Not connected. `since`: when it was lost (or first failed); `retryAt`: null while an attempt runs. */
  | { kind: "lost"; since: number; reason: string; attempts: number; retryAt: number | null };

export type OpenRemote = (signal: AbortSignal) => Promise<Remote>;

export class Link {
  readonly state = new Store<LinkState>({ kind: "connecting" });
  readonly #open: OpenRemote;
  readonly #random: () => number;
  #attempts = 0;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #attempt: AbortController | null = null;
  #remote: Remote | null = null;
  #disposed = false;

  /** Starts connecting at once. */
  constructor(open: OpenRemote, random: () => number = Math.random) {
    this.#open = open;
    this.#random = random;
    void this.#connect();
  }

  /** Connects now instead of at the end of the wait; nothing happens while online or connecting. */
  retryNow(): void {
    if (this.#disposed || this.#remote || this.#attempt) return;
    clearTimeout(this.#timer);
    void this.#connect();
  }

  /** The gateway has news of the device: one that came back is tried at once, with the waits starting over. */
  deviceIsBack(): void {
    if (this.#remote || this.#attempt) return;
    this.#attempts = 0;
    this.retryNow();
  }

  dispose(): void {
    if (this.#disposed) return;
    this.#disposed = true;
    clearTimeout(this.#timer);
    this.#attempt?.abort();
    this.#remote?.close();
    this.#remote = null;
  }

  async #connect(): Promise<void> {
    const attempt = new AbortController();
    this.#attempt = attempt;
    const before = this.state.value;
    if (before.kind === "lost") this.state.value = { ...before, retryAt: null };
    try {
      const remote = await this.#open(attempt.signal);
      if (this.#disposed) {
        remote.close();
        return;
      }
      this.#attempt = null;
      this.#attempts = 0;
      this.#remote = remote;
      remote.onClose((reason) => {
        if (this.#remote !== remote) return;
        this.#remote = null;
        this.#lose(reason);
      });
      if (this.#remote === remote) this.state.value = { kind: "online", since: Date.now(), remote };
    } catch (error) {
      this.#attempt = null;
      if (!this.#disposed) this.#lose(explain(error));
    }
  }

  #lose(reason: string): void {
    if (this.#disposed) return;
    const before = this.state.value;
    const since = before.kind === "lost" ? before.since : Date.now();
    const wait = backoffMs(this.#attempts, this.#random);
    this.#attempts += 1;
    this.state.value = { kind: "lost", since, reason, attempts: this.#attempts, retryAt: Date.now() + wait };
    this.#timer = setTimeout(() => void this.#connect(), wait);
  }
}
