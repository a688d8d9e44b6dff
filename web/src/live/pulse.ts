// Whether the device still answers: asked twice a second while somebody looks, so that a frozen one is seen within a second.
// Layer: web/live.

import { useEffect, useState } from "preact/hooks";
import { isUnanswered } from "../robot/control";
import type { Remote } from "../robot/remote";
import { openFeeds } from "./feed";

const EVERY_MS = 400;
const SILENT_MS = 500;
const PATIENCE_MS = 10_000; // what waits longer is asked anew

export class Pulse {
  readonly #ask: (timeoutMs: number) => Promise<boolean>;
  #isAsking = false;
  #askedAt = -Infinity;
  /** When the first question was asked that nothing has been answered since. */
  #silentSince: number | null = null;
  /** Whether the last answer was one to a question. */
  #hasAnswered = false;

  /**
   * `ask`: rejects with RequestTimeout, or with ConnectionError of a gateway, without an answer; any other refusal is one. False: there
   * is nothing to ask for.
   */
  constructor(ask: (timeoutMs: number) => Promise<boolean>) {
    this.#ask = ask;
  }

  /**
   * Asks when it is time to.
   * `stillMs`  how long nothing has come that came regularly: what a device says that answers no questions of its own.
   * @returns milliseconds since the device should have answered; 0 while it does.
   */
  look(now: number, stillMs: number, isShared: boolean): number {
    if (!this.#isAsking && now - this.#askedAt >= EVERY_MS) this.#begin(now);
    const waits = this.#silentSince === null ? 0 : now - this.#silentSince;
    // A gateway may answer for a device that it shares.
    return Math.max(waits, this.#hasAnswered && !isShared ? 0 : stillMs);
  }

  #begin(now: number): void {
    this.#isAsking = true;
    this.#askedAt = now;
    this.#silentSince ??= now;
    const answered = (hasAnswered: boolean): void => {
      this.#isAsking = false;
      this.#silentSince = null;
      this.#hasAnswered = hasAnswered;
    };
    this.#ask(PATIENCE_MS).then(answered, (error: unknown) => {
      if (!isUnanswered(error)) return answered(true);
      this.#isAsking = false;
      this.#hasAnswered = false;
    });
  }
}

/** Milliseconds since the device should have answered; null while it does, and without connection. */
export function usePulse(object: Remote | null, isShared: boolean): number | null {
  const [silent, setSilent] = useState<number | null>(null);
  useEffect(() => {
    setSilent(null);
    if (!object) return;
    const pulse = new Pulse((timeout) => object.ping(timeout));
    const timer = setInterval(() => {
      if (document.hidden) return;
      const now = performance.now();
      const waits = pulse.look(now, stillness(object, now), isShared);
      setSilent(waits > SILENT_MS ? Math.floor(waits / 100) * 100 : null);
    }, EVERY_MS / 4);
    return () => clearInterval(timer);
  }, [object, isShared]);
  return silent;
}

/** How long all is old that came regularly from this object; 0 while any comes. */
function stillness(object: Remote, now: number): number {
  const regular = openFeeds().filter((feed) => feed.object === object && feed.pace.periodMs !== null);
  if (regular.length === 0 || !regular.every(({ pace }) => pace.isStale(now))) return 0;
  return Math.min(...regular.map(({ pace }) => pace.ageMs(now) ?? 0));
}
