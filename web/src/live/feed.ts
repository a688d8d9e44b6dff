// What comes from one member of one object: one connection, however many panels look at it.
// Layer: web/live.

import { explain } from "../robot/remote";
import type { Account, Remote } from "../robot/remote";
import { Pace } from "./pace";
import { pause, untilDone } from "./pause";
import { Shared } from "./shared";

export type FeedKind = "wire" | "pipe" | "property" | "event";

const PROPERTY_MS = 500;

/** `isAfterGap`: it is the first, or those before it had become stale. */
export type Heard = (value: unknown, now: number, isAfterGap: boolean) => void;

export class Feed {
  readonly pace = new Pace();
  readonly heard = new Set<Heard>();
  newest: unknown = undefined;
  failure: string | null = null;
  /** Of the wire or pipe that is connected: what became of its values on their way. */
  account: Account | null = null;
  #stop: AbortController | null = null;

  constructor(
    readonly object: Remote,
    readonly kind: FeedKind,
    readonly member: string,
  ) {}

  start(): void {
    const stop = new AbortController();
    this.#stop = stop;
    void this.#keepRunning(stop.signal);
  }

  stop(): void {
    this.#stop?.abort();
    this.#stop = null;
  }

  /** What failed, or was closed, is tried again, more and more rarely until something comes. */
  #keepRunning(signal: AbortSignal): Promise<void> {
    let before = 0;
    const work = (): Promise<void> => {
      before = this.pace.count;
      return this.#run(signal);
    };
    const failed = (error: unknown): boolean => {
      this.failure = explain(error);
      return this.pace.count > before;
    };
    return untilDone(work, failed, signal);
  }

  async #run(signal: AbortSignal): Promise<void> {
    const { object, kind, member } = this;
    if (kind === "event") {
      const off = object.on(member, (...args) => this.#take(args));
      signal.addEventListener("abort", off, { once: true });
      return;
    }
    if (kind === "property") return this.#poll(signal);
    const opened = (account: Account): void => void (this.account = account);
    const values = kind === "wire" ? object.wire(member, signal, opened) : object.pipe(member, signal, opened);
    try {
      for await (const value of values) this.#take(value);
    } finally {
      this.account = null;
    }
    if (!signal.aborted) throw new Error("the device closed it");
  }

  async #poll(signal: AbortSignal): Promise<void> {
    while (!signal.aborted) {
      const begun = performance.now();
      try {
        if (!document.hidden) this.#take(await this.object.get(this.member));
        this.failure = null;
      } catch (error) {
        this.failure = explain(error);
      }
      await pause(Math.max(50, PROPERTY_MS - (performance.now() - begun)), signal);
    }
  }

  #take(value: unknown): void {
    if (this.#stop === null) return;
    const now = performance.now();
    this.newest = value;
    this.failure = null;
    const isAfterGap = this.pace.count === 0 || this.pace.isStale(now);
    this.pace.hear(now);
    for (const heard of this.heard) heard(value, now, isAfterGap);
  }
}

const feeds = new Shared<Remote, Shared<string, Feed>>();

/** Joins whoever looks at it already. */
export function openFeed(object: Remote, kind: FeedKind, member: string): { feed: Feed; close: () => void } {
  const ofObject = feeds.open(object, () => ({ value: new Shared<string, Feed>(), end: () => undefined }));
  const { value: feed, close } = ofObject.value.open(`${kind} ${member}`, () => {
    const made = new Feed(object, kind, member);
    made.start();
    return { value: made, end: () => made.stop() };
  });
  return { feed, close: () => (close(), ofObject.close()) };
}

/** All that this page follows now. */
export function openFeeds(): Feed[] {
  return feeds.values.flatMap(({ values }) => values);
}
