// Who holds leases and locks of an object, as the gateway's own service tells it: also where this page holds none.
// Layer: web/live. Source: robdef/org.rrgate.gateway.robdef.

import { useEffect, useState } from "preact/hooks";
import { t } from "../app/language";
import { Store, useStore } from "../app/store";
import { socketUrl } from "../gateway/devices";
import { isRecord, text } from "../gateway/fields";
import { session } from "../gateway/session";
import { Link, openIn } from "../robot/link";
import type { LinkState } from "../robot/link";
import { Shared } from "./shared";
import { useFeed } from "./use_feed";

export interface Holder {
  what: "lease" | "user" | "client" | "monitor";
  /** With the service's name: "Create.axes". */
  path: string;
  /** "": somebody who has not logged in. */
  user: string;
  /** Of a lease: it ends so long after its last renewal. 0: of a lock. */
  deadmanMs: number;
  /** Of a lease: to its end without another renewal, when the gateway was asked last. null: of a lock, or it does not tell. */
  leftMs: number | null;
}

export interface Holders {
  /** null: not known. */
  found: readonly Holder[] | null;
  /** Why not. */
  failure: string | null;
}

const nowhere = new Store<LinkState>({ kind: "connecting" });

/** Of the object, of those above it, which hold for it, too, and of those below it. */
export function useHolders({ device, service, object }: { device: string; service: string; object: string }): Holders {
  const [link, setLink] = useState<Link | null>(null);
  useEffect(() => {
    const opened = openGateway();
    setLink(opened.value);
    return opened.close;
  }, []);
  const state = useStore(link?.state ?? nowhere);
  const gateway = openIn(state);
  const leases = useFeed(gateway, "property", "leases");
  const locks = useFeed(gateway, "property", "locks");
  const failure = state.kind === "lost" ? state.reason : (leases.failure ?? locks.failure);
  if (!gateway || failure !== null || leases.value === undefined || locks.value === undefined)
    return { found: null, failure };
  const own = object === "" ? service : `${service}.${object}`;
  const found = readHolders(leases.value, locks.value, device).filter(({ path }) => isAbout(path, own));
  return { found, failure: null };
}

export function readHolders(leases: unknown, locks: unknown, device: string): Holder[] {
  const of = (list: unknown): Record<string, unknown>[] =>
    (Array.isArray(list) ? list.filter(isRecord) : []).filter((each) => each["device"] === device);
  const held = of(leases).filter((each) => each["held"] === true);
  const base = (each: Record<string, unknown>) => ({ path: text(each["path"]), user: text(each["user"]) });
  return [
    ...held.map((each) => ({
      ...base(each),
      what: "lease" as const,
      deadmanMs: Number(each["deadman"]),
      leftMs: leftOf(each["left"]),
    })),
    ...of(locks).map((each) => ({ ...base(each), what: kindOf(each["kind"]), deadmanMs: 0, leftMs: null })),
  ];
}

/** An older gateway does not tell. */
function leftOf(left: unknown): number | null {
  return typeof left === "number" ? left : null;
}

/** Whoever it is, in words. */
export function nameOfHolder({ user }: Holder): string {
  return user === "" ? t("somebody who is not signed in") : user;
}

/** When a lease ends, in words. */
export function endOfLease({ deadmanMs, leftMs }: Holder): string {
  return leftMs === null
    ? t("until {0} s after its last renewal", deadmanMs / 1000)
    : t("{0} s left, unless it is renewed", Math.ceil(leftMs / 1000));
}

/** Whether it is the object, or one above or below it. */
export function isAbout(path: string, own: string): boolean {
  return path === own || own.startsWith(`${path}.`) || path.startsWith(`${own}.`);
}

function kindOf(kind: unknown): Holder["what"] {
  return kind === "client" || kind === "monitor" ? kind : "user";
}

const gateways = new Shared<"gateway", Link>();

/** One connection, however many panels look. */
function openGateway(): { value: Link; close: () => void } {
  return gateways.open("gateway", () => {
    const link = new Link(() => session.withTicket(socketUrl("gateway", "gateway")), "gateway");
    return { value: link, end: () => link.dispose() };
  });
}
