// The wires and pipes of the clients of a shared device and what each has lost, asked again every few seconds while shown.
// Layer: web/gateway. Source: GET /api/v1/devices/NAME/subscriptions.

import { Store } from "../app/store";
import { count, isRecord, text } from "./fields";
import { Poller, reasonOf } from "./poller";
import { problemOf } from "./answer";
import { session } from "./session";

export interface Subscription {
  client: string;
  /** Of the object: "Webcam.Webcams[0]". */
  path: string;
  member: string;
  kind: string;
  delivered: number;
  /** Replaced by a newer value before there was room. */
  conflated: number;
  dropped: number;
  /** Milliseconds, when they were handed to the client's connection. */
  ageP50Ms: number;
  ageP99Ms: number;
}

export type SubscriptionsState =
  | { kind: "loading" }
  | { kind: "known"; subscriptions: Subscription[] }
  /** The gateway refuses to tell. */
  | { kind: "denied"; reason: string }
  /** It does not answer; `subscriptions` are what it said last, null if it never did. */
  | { kind: "away"; since: number; reason: string; subscriptions: Subscription[] | null };

const POLL_MS = 3_000;

export class SubscriptionList {
  readonly state = new Store<SubscriptionsState>({ kind: "loading" });
  readonly #device: string;
  readonly #poller = new Poller<SubscriptionsState>({
    ask: (signal) => this.#fetch(signal),
    answered: (next) => (this.state.value = next),
    failed: (error) => (this.state.value = awayAfter(this.state.value, error, Date.now())),
    period: POLL_MS,
    hiddenPeriod: null, // nobody looks at a hidden tab
  });

  constructor(device: string) {
    this.#device = device;
  }

  start(): void {
    this.#poller.start();
  }

  stop(): void {
    this.#poller.stop();
  }

  async #fetch(signal: AbortSignal): Promise<SubscriptionsState> {
    const path = `api/v1/devices/${encodeURIComponent(this.#device)}/subscriptions`;
    const response = await session.fetch(path, { signal });
    if (response.ok) return { kind: "known", subscriptions: readSubscriptions(await response.json()) };
    const reason = await problemOf(response);
    if (response.status === 401 || response.status === 403) return { kind: "denied", reason };
    throw new Error(reason);
  }
}

/** The state when asking has failed: it keeps what was known. */
export function awayAfter(before: SubscriptionsState, error: unknown, now: number): SubscriptionsState {
  return {
    kind: "away",
    since: before.kind === "away" ? before.since : now,
    reason: reasonOf(error),
    subscriptions: subscriptionsOf(before),
  };
}

export function subscriptionsOf(state: SubscriptionsState): Subscription[] | null {
  return state.kind === "known" || state.kind === "away" ? state.subscriptions : null;
}

/** By member, then client: rows stay where they are from look to look. @throws Error when it is no list. */
export function readSubscriptions(answer: unknown): Subscription[] {
  const list = (answer as { subscriptions?: unknown } | null)?.subscriptions;
  if (!Array.isArray(list)) throw new Error('the answer of the gateway has no list "subscriptions"');
  return list
    .filter(isRecord)
    .map((each) => ({
      client: text(each["client"]),
      path: text(each["path"]),
      member: text(each["member"]),
      kind: text(each["kind"]),
      delivered: count(each["delivered"]),
      conflated: count(each["conflated"]),
      dropped: count(each["dropped"]),
      ageP50Ms: count(each["age_p50_ms"]),
      ageP99Ms: count(each["age_p99_ms"]),
    }))
    .sort((a, b) => compare(`${a.path}.${a.member}`, `${b.path}.${b.member}`) || compare(a.client, b.client));
}

function compare(a: string, b: string): number {
  return a < b ? -1 : a > b ? 1 : 0;
}
