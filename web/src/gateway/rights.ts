// What this page's user may do, by what the gateway says.
// Layer: web/gateway. Source: GET /api/v1/access.

import { isRecord, text } from "./fields";
import { expectOk } from "./answer";
import { session } from "./session";

export interface DeviceRights {
  device: string;
  /** Verbs that hold for everything of the device. */
  all: string[];
  /** Verbs that hold for some of it. */
  some: string[];
}

export interface Rights {
  /** How it was shown who one is: "password", "token", ... */
  proof: string;
  /** Milliseconds, as Date.now() counts them; null: what was shown does not expire. */
  expiresAt: number | null;
  /** What may be done to the gateway itself. */
  gateway: string[];
  devices: DeviceRights[];
}

/** @throws Error (rejects) with what the gateway says, or why it says nothing. */
export async function askRights(signal: AbortSignal): Promise<Rights> {
  const response = await session.fetch("api/v1/access", { signal });
  await expectOk(response);
  return readRights(await response.json());
}

/** @throws Error when rights are missing, as in the answer of an older gateway: that is not "no rights". */
export function readRights(answer: unknown, now = Date.now()): Rights {
  const { proof, expires_in: left, may, devices } = isRecord(answer) ? answer : {};
  if (!isRecord(devices)) throw new Error('the answer of the gateway has no object "devices"');
  return {
    proof: text(proof),
    expiresAt: typeof left === "number" ? now + left * 1000 : null,
    gateway: Array.isArray(may) ? may.filter((verb) => typeof verb === "string") : [],
    devices: Object.entries(devices).map(([device, verbs]) => ({
      device,
      all: verbsOf(verbs, "all"),
      some: verbsOf(verbs, "some"),
    })),
  };
}

function verbsOf(verbs: unknown, extent: string): string[] {
  return Object.entries(isRecord(verbs) ? verbs : {})
    .filter(([, value]) => value === extent)
    .map(([verb]) => verb);
}
