// Addresses of the pages: `#/` and `#/devices/<device>/<service>[/<object>...][?view=members]`.
// Layer: web/app. A fragment, so that any static file server can hold the page.

import { Store } from "./store";

/** One step along objrefs: the member and, where it has one, the index. */
export interface PathStep {
  member: string;
  index: string | null;
}

export type Route =
  | { page: "devices" }
  | { page: "service"; device: string; service: string; path: PathStep[]; view: "auto" | "members" }
  | { page: "unknown"; address: string };

export function parseRoute(hash: string): Route {
  const address = hash.replace(/^#/, "");
  const [path = "", query = ""] = address.split("?", 2);
  let segments: string[];
  try {
    segments = path.split("/").filter(Boolean).map(decodeURIComponent);
  } catch {
    return { page: "unknown", address };
  }
  if (segments.length === 0) return { page: "devices" };
  const [kind, device, service, ...steps] = segments;
  if (kind !== "devices" || !device || !service) return { page: "unknown", address };
  const view = new URLSearchParams(query).get("view") === "members" ? "members" : "auto";
  return { page: "service", device, service, path: steps.map(parseStep), view };
}

export function formatRoute(device: string, service: string, path: readonly PathStep[] = [], view = "auto"): string {
  const segments = [device, service, ...path.map(formatStep)].map(encodeURIComponent);
  return `#/devices/${segments.join("/")}${view === "members" ? "?view=members" : ""}`;
}

export function formatStep(step: PathStep): string {
  return step.index === null ? step.member : `${step.member}[${step.index}]`;
}

function parseStep(segment: string): PathStep {
  const match = /^([^[]+)\[(.*)\]$/s.exec(segment);
  return match ? { member: match[1] ?? "", index: match[2] ?? "" } : { member: segment, index: null };
}

/** The current page; follows the address bar. */
export function watchRoute(): Store<Route> {
  const route = new Store(parseRoute(location.hash));
  window.addEventListener("hashchange", () => (route.value = parseRoute(location.hash)));
  return route;
}
