// Requests of access, and deciding on them.
// Layer: web/gateway. Source: /api/v1/access/requests.

import { Store } from "../app/store";
import { isRecord, text } from "./fields";
import { expectOk } from "./answer";
import type { Session } from "./session";

export interface AccessRequest {
  id: string;
  name: string;
  reason: string;
  client: string;
}

const PATH = "api/v1/access/requests";
const POLL_MS = 5_000;

export class AccessDesk {
  readonly pending = new Store<AccessRequest[]>([]);
  readonly trouble = new Store<string | null>(null);
  readonly #session: Pick<Session, "fetch" | "who">;

  constructor(session: Pick<Session, "fetch" | "who">) {
    this.#session = session;
    session.who.watch((who) => {
      if (who?.admin) void this.#list();
      else this.pending.value = []; // what one user saw is not for the next
    });
  }

  start(): void {
    void this.#look();
  }

  /** Gives the client a token with these roles. */
  async approve(request: AccessRequest, roles: string[]): Promise<void> {
    await this.#decide(request, "approve", { roles });
  }

  async deny(request: AccessRequest): Promise<void> {
    await this.#decide(request, "deny", {});
  }

  async #decide(request: AccessRequest, what: string, body: object): Promise<void> {
    try {
      await this.#send(`${request.id}/${what}`, body);
      this.trouble.value = null;
    } catch (error) {
      this.trouble.value = (error as Error).message;
    }
    await this.#list();
  }

  async #look(): Promise<void> {
    if (this.#session.who.value?.admin && !document.hidden) await this.#list();
    // A gateway that lets everybody in has nothing to decide.
    if (this.#session.who.value?.login !== false) setTimeout(() => void this.#look(), POLL_MS);
  }

  async #list(): Promise<void> {
    try {
      const response = await this.#session.fetch(PATH);
      if (!response.ok) return;
      const requests = readRequests(await response.json());
      if (this.#session.who.value?.admin) this.pending.value = requests; // it may be another user by now
    } catch {
      // The list of devices tells that the gateway is away.
    }
  }

  /** @throws Error with what the gateway said. */
  async #send(path: string, body: object): Promise<void> {
    const response = await this.#session.fetch(`${PATH}/${path}`, {
      method: "POST",
      headers: { "Content-Type": "application/json" },
      body: JSON.stringify(body),
    });
    await expectOk(response);
  }
}

/** Those that are to be decided on. */
export function readRequests(answer: unknown): AccessRequest[] {
  const list = (answer as { requests?: unknown } | null)?.requests;
  if (!Array.isArray(list)) return [];
  return list
    .filter(isRecord)
    .filter((each) => each["state"] === "pending" && typeof each["id"] === "string")
    .map((each) => ({
      id: text(each["id"]),
      name: text(each["name"]),
      reason: text(each["reason"]),
      client: text(each["client"]),
    }));
}
