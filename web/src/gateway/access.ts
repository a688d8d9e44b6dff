// Who the gateway takes this page for, and requests of access: asking, and deciding on them.
// Layer: web/gateway. Source: GET /api/v1/access, /api/v1/access/requests.

import { Store } from "../app/store";
import { isRecord, text } from "./fields";

export interface Who {
  /** null: the page has shown nothing. */
  user: string | null;
  /** Whether the gateway asks who one is at all. */
  login: boolean;
  /** Whether one may ask for access. */
  requests: boolean;
  /** Whether this user decides on requests. */
  admin: boolean;
}

export interface AccessRequest {
  id: string;
  name: string;
  reason: string;
  client: string;
}

const POLL_MS = 5_000;

export class AccessDesk {
  readonly who = new Store<Who | null>(null);
  readonly pending = new Store<AccessRequest[]>([]);
  readonly trouble = new Store<string | null>(null);

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
      await send(`requests/${request.id}/${what}`, body);
      this.trouble.value = null;
    } catch (error) {
      this.trouble.value = (error as Error).message;
    }
    await this.#list();
  }

  async #look(): Promise<void> {
    try {
      const response = await fetch(address(""), { cache: "no-store" });
      if (response.ok) this.who.value = readWho(await response.json());
    } catch {
      // The list of devices tells that the gateway is away.
    }
    if (this.who.value?.admin && !document.hidden) await this.#list();
    // A gateway that lets everybody in has nothing to decide.
    if (this.who.value?.login !== false) setTimeout(() => void this.#look(), POLL_MS);
  }

  async #list(): Promise<void> {
    try {
      const response = await fetch(address("requests"), { cache: "no-store" });
      if (response.ok) this.pending.value = readRequests(await response.json());
    } catch {
      // As above.
    }
  }
}

function address(path: string): URL {
  return new URL(path === "" ? "api/v1/access" : `api/v1/access/${path}`, document.baseURI);
}

/** @throws Error with what the gateway said. */
async function send(path: string, body: object): Promise<void> {
  const response = await fetch(address(path), {
    method: "POST",
    headers: { "Content-Type": "application/json" },
    body: JSON.stringify(body),
  });
  if (response.ok) return;
  const problem = (await response.json().catch(() => null)) as { detail?: unknown } | null;
  throw new Error(typeof problem?.detail === "string" ? problem.detail : `the gateway answered ${response.status}`);
}

export function readWho(answer: unknown): Who {
  const given = (answer ?? {}) as Record<string, unknown>;
  const user = given["user"];
  return {
    user: typeof user === "string" ? user : null,
    login: given["login"] === true,
    requests: given["requests"] === true,
    admin: given["admin"] === true,
  };
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
