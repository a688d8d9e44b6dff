// What the gateway says about its devices, asked again every two seconds while somebody looks.
// Layer: web/gateway. Source: GET /api/v1/devices.

import { Store } from "../app/store";
import { isRecord, text } from "./fields";
import { Poller, reasonOf } from "./poller";
import { session } from "./session";

export type DeviceState = "online" | "offline" | "connecting";

/** Whether each client has a connection of its own to the device, or all share the gateway's. */
export type DeviceMode = "relay" | "shared";

export interface Service {
  name: string;
  /** Qualified type of the root object; empty until the gateway has read it. */
  type: string;
}

export interface Device {
  name: string;
  url: string;
  /** By discovery; not configured. */
  found: boolean;
  nodeId: string;
  nodeName: string;
  state: DeviceState;
  lastError: string | null;
  services: Service[];
  /** null: not the gateway's, or an older gateway does not say. */
  mode: DeviceMode | null;
  clients: number | null;
  /** "path.member" of what makes it safe when a lease of it ends. */
  safe: string[];
}

export type GatewayState =
  | { kind: "loading" }
  | { kind: "known"; devices: Device[] }
  /** The gateway does not answer; `devices` is what it said last, null if it never did. */
  | { kind: "away"; since: number; reason: string; devices: Device[] | null };

const POLL_MS = 2_000;

export class DeviceList {
  readonly state = new Store<GatewayState>({ kind: "loading" });
  /** The same, and told also where an answer is as the one before. */
  readonly answers = new Store<GatewayState>({ kind: "loading" });
  #said = "";
  readonly #poller = new Poller<Device[]>({
    ask: fetchDevices,
    answered: (devices) => this.#tell({ kind: "known", devices }),
    failed: (error) => {
      const before = this.state.value;
      this.#tell({
        kind: "away",
        since: before.kind === "away" ? before.since : Date.now(),
        reason: reasonOf(error),
        devices: devicesOf(before),
      });
    },
    period: POLL_MS,
    hiddenPeriod: POLL_MS * 5, // enough to be right when it is shown
  });

  start(): void {
    this.#poller.start();
  }

  /** Forgets what it knows: it is not for everybody. */
  stop(): void {
    this.#tell({ kind: "loading" });
    this.#poller.stop();
  }

  /** Asks now. */
  refresh(): void {
    this.#poller.refresh();
  }

  /** Whole pages follow the state: what is as before is not told to them. */
  #tell(next: GatewayState): void {
    this.answers.value = next;
    const said = JSON.stringify(next);
    if (said === this.#said) return;
    this.#said = said;
    this.state.value = next;
  }
}

export function devicesOf(state: GatewayState): Device[] | null {
  return state.kind === "loading" ? null : state.devices;
}

/** Whether all clients share the gateway's connection to the device. */
export function isShared(state: GatewayState, device: string): boolean {
  return devicesOf(state)?.find(({ name }) => name === device)?.mode === "shared";
}

async function fetchDevices(signal: AbortSignal): Promise<Device[]> {
  const response = await session.fetch("api/v1/devices", { signal });
  if (!response.ok) throw new Error(`the gateway answered ${response.status} ${response.statusText}`.trim());
  return readDevices(await response.json());
}

/** Reads the answer field by field: an older or newer gateway may leave some out. @throws Error when it is no list. */
export function readDevices(answer: unknown): Device[] {
  const list = (answer as { devices?: unknown } | null)?.devices;
  if (!Array.isArray(list)) throw new Error('the answer of the gateway has no list "devices"');
  return list.filter(isRecord).map((device) => ({
    name: text(device["name"]),
    url: text(device["url"]),
    found: device["found"] === true,
    nodeId: text(device["node_id"]),
    nodeName: text(device["node_name"]),
    state: stateOf(device["state"]),
    lastError: typeof device["last_error"] === "string" ? device["last_error"] : null,
    services: readServices(device["services"]),
    mode: device["mode"] === "relay" || device["mode"] === "shared" ? device["mode"] : null,
    clients: typeof device["clients"] === "number" ? device["clients"] : null,
    safe: Array.isArray(device["safe"]) ? device["safe"].map(text) : [],
  }));
}

function readServices(services: unknown): Service[] {
  if (!Array.isArray(services)) return [];
  return services.filter(isRecord).map((service) => ({ name: text(service["name"]), type: text(service["type"]) }));
}

function stateOf(state: unknown): DeviceState {
  return state === "online" || state === "connecting" ? state : "offline";
}

/** Whether a device plays a recording of the gateway's: no other has such a name. */
export function isReplay(device: string): boolean {
  return device.startsWith("replay~");
}

/** Where a service of a device is reached through the gateway that served this page. */
export function relayUrl(device: string, service: string, base?: string): string {
  return socketUrl(`devices/${encodeURIComponent(device)}`, service, base);
}

/** Where a service at a path of that gateway is reached. */
export function socketUrl(path: string, service: string, base: string = document.baseURI): string {
  const url = new URL(path, base);
  url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
  url.search = new URLSearchParams({ service }).toString();
  url.hash = "";
  return url.href;
}
