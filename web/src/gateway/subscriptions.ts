// The wires and pipes of the clients of a shared device and what each has lost, asked again every few seconds while shown.
// Layer: web/gateway. Source: GET /api/v1/devices/NAME/subscriptions.

import { count, isRecord, text } from "./fields";
import { PolledList } from "./polled_list";

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

const POLL_MS = 3_000;

export function subscriptionsAt(device: string): PolledList<Subscription> {
  return new PolledList(`api/v1/devices/${encodeURIComponent(device)}/subscriptions`, readSubscriptions, POLL_MS);
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
