// Which devices of many are wanted: searched by words, by state and by type, in groups; remembered in this browser.
// Layer: web/pages, pure but for the storage.

import type { Device, DeviceState } from "../gateway/devices";
import { isRecord, text } from "../gateway/fields";

export const STATES: readonly DeviceState[] = ["online", "connecting", "offline"];
export const GROUPINGS = ["", "state", "type"] as const;

export interface Wish {
  /** All of its words are in the name, the address, the node or the services. */
  words: string;
  state: DeviceState | "";
  /** Of a service; "" for all. */
  type: string;
  group: (typeof GROUPINGS)[number];
}

export const ANY: Wish = { words: "", state: "", type: "", group: "" };

export interface Group {
  /** "" where all are together. */
  name: string;
  devices: readonly Device[];
}

export function wanted(devices: readonly Device[], wish: Wish): Group[] {
  const words = wish.words.toLowerCase().split(/\s+/).filter(Boolean);
  const found = devices.filter((device) => fits(device, words, wish));
  if (wish.group === "") return found.length === 0 ? [] : [{ name: "", devices: found }];
  const groups = new Map<string, Device[]>(wish.group === "state" ? STATES.map((state) => [state, []]) : []);
  for (const device of found) {
    const name = wish.group === "state" ? device.state : typeOf(device);
    const members = groups.get(name) ?? [];
    groups.set(name, members);
    members.push(device);
  }
  const all = [...groups]
    .map(([name, members]) => ({ name, devices: members }))
    .filter((each) => each.devices.length > 0);
  return wish.group === "type" ? all.sort((a, b) => a.name.localeCompare(b.name)) : all;
}

/** Of all services, each once. */
export function typesOf(devices: readonly Device[]): string[] {
  const types = new Set(devices.flatMap(({ services }) => services.map(({ type }) => type)));
  types.delete("");
  return [...types].sort();
}

const typeOf = ({ services }: Device): string => services[0]?.type ?? "";

function fits({ name, url, nodeName, state, services }: Device, words: readonly string[], wish: Wish): boolean {
  if (wish.state !== "" && state !== wish.state) return false;
  if (wish.type !== "" && !services.some(({ type }) => type === wish.type)) return false;
  if (words.length === 0) return true;
  const told = [name, url, nodeName, ...services.flatMap((each) => [each.name, each.type])].join("\n").toLowerCase();
  return words.every((word) => told.includes(word));
}

const KEY = "rrgate-home";

export function recallWish(storage: Pick<Storage, "getItem"> = localStorage): Wish {
  try {
    const kept: unknown = JSON.parse(storage.getItem(KEY) ?? "null");
    if (!isRecord(kept)) return ANY;
    return {
      words: text(kept["words"]),
      type: text(kept["type"]),
      state: STATES.find((each) => each === kept["state"]) ?? "",
      group: GROUPINGS.find((each) => each === kept["group"]) ?? "",
    };
  } catch {
    return ANY; // storage is forbidden, or of another page
  }
}

export function keepWish(wish: Wish, storage: Pick<Storage, "setItem"> = localStorage): void {
  try {
    storage.setItem(KEY, JSON.stringify(wish));
  } catch {
    // Storage may be forbidden or full: it holds until the page is left.
  }
}
