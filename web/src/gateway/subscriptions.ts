// The wires and pipes of the clients of a shared device and what each has lost, asked again every few seconds while shown.
// Layer: web/gateway. Source: GET /api/v1/devices/NAME/subscriptions.

import { Store } from "../app/store";

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
  age_p50_ms: number;
  age_p99_ms: number;
}

export type SubscriptionsState =
  | { kind: "loading" }
  | { kind: "known"; subscriptions: Subscription[] }
  /** The gateway refuses to tell. */
  | { kind: "denied"; reason: string }
  /** It does not answer; `subscriptions` are what it said last, null if it never did. */
  | { kind: "away"; since: number; reason: string; subscriptions: Subscription[] | null };

const POLL_MS = 3_000;
const DEADLINE_MS = 5_000;

export class SubscriptionList {
  readonly state = new Store<SubscriptionsState>({ kind: "loading" });
  readonly #device: string;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #abort: AbortController | null = null;

  constructor(device: string) {
    this.#device = device;
  }

  start(): void {
    document.addEventListener("visibilitychange", this.#on_visibility);
    void this.#poll();
  }

  stop(): void {
    document.removeEventListener("visibilitychange", this.#on_visibility);
    clearTimeout(this.#timer);
    this.#abort?.abort();
    this.#abort = null;
  }

  readonly #on_visibility = (): void => {
    clearTimeout(this.#timer);
    if (!document.hidden && !this.#abort) void this.#poll();
  };

  async #poll(): Promise<void> {
    const abort = new AbortController();
    this.#abort = abort;
    const deadline = setTimeout(() => abort.abort(new Error("the gateway did not answer within 5 s")), DEADLINE_MS);
    let next: SubscriptionsState;
    try {
      next = await this.#fetch(abort.signal);
    } catch (error) {
      next = away_after(this.state.value, error, Date.now());
    } finally {
      clearTimeout(deadline);
    }
    if (this.#abort !== abort) return; // stopped meanwhile
    this.#abort = null;
    this.state.value = next;
    // Nobody looks at a hidden tab; it asks again once it is shown.
    if (!document.hidden) this.#timer = setTimeout(() => void this.#poll(), POLL_MS);
  }

  async #fetch(signal: AbortSignal): Promise<SubscriptionsState> {
    const url = new URL(`api/v1/devices/${encodeURIComponent(this.#device)}/subscriptions`, document.baseURI);
    const response = await fetch(url, { signal, cache: "no-store" });
    if (response.ok) return { kind: "known", subscriptions: read_subscriptions(await response.json()) };
    const problem = (await response.json().catch(() => null)) as { detail?: unknown } | null;
    const reason = typeof problem?.detail === "string" ? problem.detail : `the gateway answered ${response.status}`;
    if (response.status === 401 || response.status === 403) return { kind: "denied", reason };
    throw new Error(reason);
  }
}

/** The state when asking has failed: it keeps what was known. */
export function away_after(before: SubscriptionsState, error: unknown, now: number): SubscriptionsState {
  return {
    kind: "away",
    since: before.kind === "away" ? before.since : now,
    reason: error instanceof TypeError ? "the gateway cannot be reached" : (error as Error).message,
    subscriptions: subscriptions_of(before),
  };
}

export function subscriptions_of(state: SubscriptionsState): Subscription[] | null {
  return state.kind === "known" || state.kind === "away" ? state.subscriptions : null;
}

/** By member, then client: rows stay where they are from look to look. @throws Error when it is no list. */
export function read_subscriptions(answer: unknown): Subscription[] {
  const list = (answer as { subscriptions?: unknown } | null)?.subscriptions;
  if (!Array.isArray(list)) throw new Error('the answer of the gateway has no list "subscriptions"');
  return list
    .filter((each): each is Record<string, unknown> => typeof each === "object" && each !== null)
    .map((each) => ({
      client: text(each["client"]),
      path: text(each["path"]),
      member: text(each["member"]),
      kind: text(each["kind"]),
      delivered: count(each["delivered"]),
      conflated: count(each["conflated"]),
      dropped: count(each["dropped"]),
      age_p50_ms: count(each["age_p50_ms"]),
      age_p99_ms: count(each["age_p99_ms"]),
    }))
    .sort((a, b) => compare(`${a.path}.${a.member}`, `${b.path}.${b.member}`) || compare(a.client, b.client));
}

function compare(a: string, b: string): number {
  return a < b ? -1 : a > b ? 1 : 0;
}

function text(value: unknown): string {
  return typeof value === "string" ? value : "";
}

function count(value: unknown): number {
  return typeof value === "number" ? value : 0;
}
