// Addresses of the pages: `#/`, `#/recordings` and `#/devices/<device>/<service>[/<object>...][?view=members|board][&board=...]`.
// Layer: web/app. A fragment, so that any static file server can hold the page.

import { Store } from "./store";

/** One step along objrefs: the member and, where it has one, the index. */
export interface PathStep {
  member: string;
  index: string | null;
}

/** "auto": what fits the object best. */
export type View = "auto" | "drive" | "board" | "members";
const VIEWS: readonly string[] = ["drive", "board", "members"];

export type Route =
  | { page: "devices" }
  | { page: "recordings" }
  | { page: "service"; device: string; service: string; path: PathStep[]; view: View; board: string | null }
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
  if (segments.length === 1 && segments[0] === "recordings") return { page: "recordings" };
  const [kind, device, service, ...steps] = segments;
  if (kind !== "devices" || !device || !service) return { page: "unknown", address };
  const given = new URLSearchParams(query);
  const view = VIEWS.includes(given.get("view") ?? "") ? (given.get("view") as View) : "auto";
  return { page: "service", device, service, path: steps.map(parseStep), view, board: given.get("board") };
}

export function formatRoute(
  device: string,
  service: string,
  path: readonly PathStep[] = [],
  view: View = "auto",
): string {
  const segments = [device, service, ...path.map(formatStep)].map(encodeURIComponent);
  return `#/devices/${segments.join("/")}${view === "auto" ? "" : `?view=${view}`}`;
}

/** Where an object is, as the gateway and boards name it: "" is the service's root. */
export function placeOf({ device, service, path }: Route & { page: "service" }): Place {
  return { device, service, object: path.map(formatStep).join(".") };
}

export interface Place {
  device: string;
  service: string;
  object: string;
}

export function formatStep(step: PathStep): string {
  return step.index === null ? step.member : `${step.member}[${step.index}]`;
}

export function parseStep(segment: string): PathStep {
  const match = /^([^[]+)\[(.*)\]$/s.exec(segment);
  return match ? { member: match[1] ?? "", index: match[2] ?? "" } : { member: segment, index: null };
}

/** The steps of an object's path: at the dots that are not within brackets, since a key may have some. */
export function splitSteps(path: string): string[] {
  return path.match(/[^.[\]]+(\[[^\]]*\])?/g) ?? [];
}

/** The current page; follows the address bar. */
export function watchRoute(): Store<Route> {
  const route = new Store(parseRoute(location.hash));
  window.addEventListener("hashchange", () => (route.value = parseRoute(location.hash)));
  return route;
}
