// Makes a device safe that has no stop of its own: by a lease that is taken, from whoever has it, and released.
// Layer: web/gateway. Source: docs/leases.md. By HTTP, so that it waits behind nothing that the page sends to the device.

import { session } from "./session";

const TIMEOUT_MS = 2_000;

/** @throws (rejects) with why it may not have been made safe. */
export async function makeSafe(device: string, service: string): Promise<void> {
  const object = `api/v1/devices/${encodeURIComponent(device)}/${encodeURIComponent(service)}`;
  const post = async (what: string, headers: Record<string, string> = {}): Promise<Response> => {
    const signal = AbortSignal.timeout(TIMEOUT_MS);
    const response = await session.fetch(`${object}?lease=${what}`, { method: "POST", headers, signal });
    if (response.ok) return response;
    const problem = (await response.json().catch(() => null)) as { detail?: unknown } | null;
    throw new Error(typeof problem?.detail === "string" ? problem.detail : `HTTP ${response.status}`);
  };
  const { lease } = (await (await post(`take&deadman=${TIMEOUT_MS}`)).json()) as { lease: string };
  await post("release", { ["Rrgate-Lease"]: lease });
}

/** Of what makes a device safe ("Create.Drive"), that of a service. */
export function safeOf(safe: readonly string[], service: string): string[] {
  return safe.filter((member) => member.startsWith(`${service}.`));
}
