// What findServices() does, loaded when it is called. Layer: wasm-client/ts. Source: GET /api/v1/devices.
import { makeError, textOf } from "../errors.js";
import type { FoundService, ServiceQuery } from "../find_services.js";
import { headersOf } from "../platform.js";
import { checkSignal, within } from "../within.js";

/* eslint-disable @typescript-eslint/naming-convention -- names of the gateway */
interface Device {
  name: string;
  state: string;
  node_id: string | null;
  node_name: string | null;
  services: { name: string; type: string; implements?: string[] }[];
}
/* eslint-enable @typescript-eslint/naming-convention */

export async function findServices(query: ServiceQuery, signal?: AbortSignal): Promise<FoundService[]> {
  const { gateway, timeout = 30_000 } = query;
  checkSignal(signal);
  const ending = new AbortController();
  const late = `devices of the gateway ${gateway}: no answer`;
  return within(ask(query, ending.signal), { signal, timeout }, late).finally(() => ending.abort());
}

async function ask(query: ServiceQuery, signal: AbortSignal): Promise<FoundService[]> {
  const found: FoundService[] = [];
  try {
    const gateway = new URL(String(query.gateway).replace(/\/*$/, "/"), globalThis.location?.href);
    const headers = headersOf(query);
    const request = { headers, signal, cache: "no-store" } as const;
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
