// Asking for access without having any: the request, and the token once somebody has approved it.
// Layer: web/gateway. Source: POST /api/v1/access/requests and .../ID/claim.

import { Store } from "../app/store";
import { isRecord, text } from "./fields";
import { expectOk } from "./answer";
import type { Session } from "./session";

export type AskState =
  | { kind: "idle" }
  | { kind: "asking" }
  | { kind: "waiting"; name: string }
  /** The token is told once. */
  | { kind: "approved"; token: string }
  | { kind: "refused"; why: "denied" | "expired" }
  | { kind: "failed"; why: string };

const PATH = "api/v1/access/requests";
const POLL_MS = 3_000;

export class AccessAsk {
  readonly state = new Store<AskState>({ kind: "idle" });
  readonly #session: Pick<Session, "fetch">;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #isOver = false;

  constructor(session: Pick<Session, "fetch">) {
    this.#session = session;
  }

  async ask(name: string, reason: string): Promise<void> {
    this.state.value = { kind: "asking" };
    try {
      const response = await this.#send("", { name, reason });
      await expectOk(response);
      const answer: unknown = await response.json();
      if (!isRecord(answer)) throw new Error("the gateway gave the request no number");
      this.state.value = { kind: "waiting", name };
      this.#claimLater(text(answer["id"]), text(answer["secret"]));
    } catch (error) {
      this.state.value = { kind: "failed", why: (error as Error).message };
    }
  }

  /** Asks no more what has become of the request. */
  dispose(): void {
    this.#isOver = true;
    clearTimeout(this.#timer);
  }

  #claimLater(id: string, secret: string): void {
    if (!this.#isOver) this.#timer = setTimeout(() => void this.#claim(id, secret), POLL_MS);
  }

  async #claim(id: string, secret: string): Promise<void> {
    let answer: unknown = null;
    try {
      const response = await this.#send(`/${encodeURIComponent(id)}/claim`, { secret });
      if (response.status === 404) return this.#refuse("expired");
      if (response.ok) answer = await response.json();
    } catch {
      // The gateway is away; the request may outlive that.
    }
    const state = isRecord(answer) ? text(answer["state"]) : "";
    if (isRecord(answer) && state === "approved") this.state.value = { kind: "approved", token: text(answer["token"]) };
    else if (state === "denied") this.#refuse("denied");
    else this.#claimLater(id, secret);
  }

  #refuse(why: "denied" | "expired"): void {
    this.state.value = { kind: "refused", why };
  }

  #send(path: string, body: object): Promise<Response> {
    return this.#session.fetch(PATH + path, {
      method: "POST",
      headers: { ["Content-Type"]: "application/json" },
      body: JSON.stringify(body),
    });
  }
}
