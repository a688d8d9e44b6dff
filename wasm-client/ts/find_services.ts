// Services of a type, among the devices of a gateway. Layer: wasm-client/ts. Source: GET /api/v1/devices.
import { makeError, textOf } from "./errors.js";
import { headersOf } from "./platform.js";
import type { Proof } from "./platform.js";

/** A service of a device of a gateway. */
export interface FoundService {
  url: string;
  /** Name of the device at the gateway. */
  device: string;
  service: string;
  /** Of the root object, qualified. */
  type: string;
  /** Types that the root object can be used as, too. */
  implements: string[];
  nodeId: string | null;
  nodeName: string | null;
}

export interface ServiceQuery extends Proof {
  /** Where the gateway is: "https://gateway.example". In a page, relative to it. */
  gateway: string | URL;
  /** Of the root object, or one that it implements; qualified: "experimental.create2.Create". */
  type: string;
  /** Which of them; all. */
  filter?: ((found: FoundService) => boolean) | undefined;
}

/* eslint-disable @typescript-eslint/naming-convention -- names of the gateway */
interface Device {
  name: string;
  state: string;
  node_id: string | null;
  node_name: string | null;
  services: { name: string; type: string; implements?: string[] }[];
}
/* eslint-enable @typescript-eslint/naming-convention */

/**
 * The services that are there now, on devices that are online.
 * @throws RobotRaconteurError ConnectionError: the gateway is not reached, or answers something else.
 */
export async function findServices(query: ServiceQuery, signal?: AbortSignal): Promise<FoundService[]> {
  const found: FoundService[] = [];
  try {
    const gateway = new URL(String(query.gateway).replace(/\/*$/, "/"), globalThis.location?.href);
    const headers = headersOf(query);
    const request = { headers, signal: signal ?? null, cache: "no-store" } as const;
    const response = await fetch(new URL("api/v1/devices", gateway), request);
    if (!response.ok) throw new Error(`HTTP ${response.status}`);
    for (const { name, state, node_id: nodeId, node_name: nodeName, services } of (
      (await response.json()) as { devices: Device[] }
    ).devices)
      for (const { name: service, type, implements: bases = [] } of state === "online" ? services : [])
        if (type === query.type || bases.includes(query.type)) {
          const url = new URL(`devices/${encodeURIComponent(name)}?service=${encodeURIComponent(service)}`, gateway);
          found.push({ url: String(url), device: name, service, type, implements: bases, nodeId, nodeName });
        }
  } catch (error) {
    throw makeError("ConnectionError", `devices of the gateway ${query.gateway}: ${textOf(error)}`);
  }
  return found.filter(query.filter ?? (() => true));
}
