// Makes a device safe that has no stop of its own, or no connection for it: by a lease that is taken, from whoever has it where
// one may, and released.
// Layer: web/gateway. Source: docs/leases.md. By HTTP, so that it waits behind nothing that the page sends to the device.

import { expectOk } from "./answer";
import { session } from "./session";

const TIMEOUT_MS = 2_000;
/** The gateway waits for the device's answer as long as that. */
const RELEASE_TIMEOUT_MS = 2 * TIMEOUT_MS;

/**
 * @returns whether the device has answered that it is safe; else the gateway has sent it, and has not been answered in time.
 * @throws (rejects) with why it may not be safe.
 */
export async function makeSafe(device: string, service: string): Promise<boolean> {
  const object = `api/v1/devices/${encodeURIComponent(device)}/${encodeURIComponent(service)}`;
  const post = async (what: string, headers: Record<string, string> = {}, ms = TIMEOUT_MS): Promise<Response> => {
    const signal = AbortSignal.timeout(ms);
    return session.fetch(`${object}?lease=${what}`, { method: "POST", headers, signal });
  };
  const taken = await post(`take&deadman=${TIMEOUT_MS}`);
  // Refused to who may take over from nobody, also where nobody has it.
  const got = await expectOk(taken.status === 403 ? await post(`acquire&deadman=${TIMEOUT_MS}`) : taken);
  const { lease } = (await got.json()) as { lease: string };
  return isAnswered(await expectOk(await post("release", { ["Rrgate-Lease"]: lease }, RELEASE_TIMEOUT_MS)));
}

/** Else the gateway has only accepted it. */
function isAnswered({ status }: Response): boolean {
  return status !== 202;
}

/** Of what makes a device safe ("Create.Drive"), that of a service. */
export function safeOf(safe: readonly string[], service: string): string[] {
  return safe.filter((member) => member.startsWith(`${service}.`));
}
