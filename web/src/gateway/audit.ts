// The last records of the gateway's audit log, for admins.
// Layer: web/gateway. Source: GET /api/v1/audit.

import { count, isRecord, text } from "./fields";
import { expectOk } from "./answer";
import { session } from "./session";

export interface Deed {
  /** The number of the record. */
  seq: number;
  /** Milliseconds, as Date.now() counts them; NaN: the record does not say. */
  at: number;
  /** Of the gateway, or of the device; empty: nobody who is known. */
  user: string;
  client: string;
  event: string;
  /** "ok", "error" or "refused". */
  outcome: string;
  device: string;
  path: string;
  member: string;
  detail: string;
}

export interface Deeds {
  /** false: the gateway has no audit log. */
  isRecorded: boolean;
  /** The newest first. */
  list: Deed[];
  /** Whether there are no older ones. */
  isAll: boolean;
}

const LIMIT = 50;

/** `user`, `device`: patterns; "" for everybody and everything. @throws Error (rejects), for people. */
export async function askDeeds(user: string, device: string, signal: AbortSignal): Promise<Deeds> {
  const query = new URLSearchParams({ limit: String(LIMIT) });
  if (user !== "") query.set("user", user);
  if (device !== "") query.set("device", device);
  const response = await session.fetch(`api/v1/audit?${query.toString()}`, { signal });
  await expectOk(response);
  return readDeeds(await response.json());
}

/** @throws Error when it is no list of records. */
export function readDeeds(answer: unknown): Deeds {
  const { enabled, records, all } = isRecord(answer) ? answer : {};
  if (!Array.isArray(records)) throw new Error('the answer of the gateway has no list "records"');
  return {
    isRecorded: enabled === true,
    isAll: all === true,
    list: records.filter(isRecord).map((each) => ({
      seq: count(each["seq"]),
      at: Date.parse(text(each["time"])),
      user: text(each["user"]) || text(each["device_user"]),
      client: text(each["client"]),
      event: text(each["event"]),
      outcome: text(each["outcome"]),
      device: text(each["device"]),
      path: text(each["path"]),
      member: text(each["member"]),
      detail: text(each["detail"]),
    })),
  };
}
