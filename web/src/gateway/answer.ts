// What the gateway answered, where it refused.
// Layer: web/gateway. Source: RFC 9457, problem details; the gateway gives a `detail` for people.

import { t } from "../app/language";

/** @throws (rejects) Error with what the gateway said about a request that it refused. */
export async function expectOk(response: Response): Promise<Response> {
  if (!response.ok) throw new Error(await problemOf(response));
  return response;
}

/** What the gateway said about a request that it refused. */
export async function problemOf(response: Response): Promise<string> {
  const problem = (await response.json().catch(() => null)) as { detail?: unknown } | null;
  return typeof problem?.detail === "string" ? problem.detail : t("the gateway answered {0}", response.status);
}
