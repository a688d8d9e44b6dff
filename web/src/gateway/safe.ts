// Makes a device safe that has no stop of its own, or no connection for it: by a lease that is taken, from whoever has it where
// one may, and released.
// Layer: web/gateway. Source: docs/leases.md. By HTTP, so that it waits behind nothing that the page sends to the device.

import { expectOk } from "./answer";
import { session } from "./session";

const TIMEOUT_MS = 2_000;

/** Settles when the gateway has sent it; what the device answers is not known. @throws (rejects) with why it may not be safe. */
export async function makeSafe(device: string, service: string): Promise<void> {
  const object = `api/v1/devices/${encodeURIComponent(device)}/${encodeURIComponent(service)}`;
  const post = async (what: string, headers: Record<string, string> = {}): Promise<Response> => {
    const signal = AbortSignal.timeout(TIMEOUT_MS);
    return session.fetch(`${object}?lease=${what}`, { method: "POST", headers, signal });
  };
  const taken = await post(`take&deadman=${TIMEOUT_MS}`);
  // Refused to who may take over from nobody, also where nobody has it.
  const got = await expectOk(taken.status === 403 ? await post(`acquire&deadman=${TIMEOUT_MS}`) : taken);
  const { lease } = (await got.json()) as { lease: string };
  await expectOk(await post("release", { ["Rrgate-Lease"]: lease }));
}

/** Of what makes a device safe ("Create.Drive"), that of a service. */
export function safeOf(safe: readonly string[], service: string): string[] {
  return safe.filter((member) => member.startsWith(`${service}.`));
}
