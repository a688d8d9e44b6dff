// What agents wait to be allowed to do, deciding on it, and stopping them all.
// Layer: web/gateway. Source: /api/v1/agents. A gateway that has no agents answers 404.

import { Store } from "../app/store";
import { ApprovalNotices } from "./approval_notices";
import { isRecord, text } from "./fields";
import { problemOf } from "./session";
import type { Session } from "./session";

export interface Approval {
  id: string;
  user: string;
  client: string;
  device: string;
  path: string;
  member: string;
  verb: string;
  /** As JSON. */
  values: string;
  why: string;
  expiresInS: number;
}

export interface Agents {
  approvals: readonly Approval[];
  /** Seconds; 0: they are not stopped. */
  stoppedForS: number;
}

export type Answer = { answer: "once" | "deny" } | { answer: "minutes"; minutes: number };

const PATH = "api/v1/agents";
const POLL_MS = 2_000;
const RARE_POLL_MS = 60_000;

export class AgentsDesk {
  /** null: the gateway has none, or this user does not decide. */
  readonly state = new Store<Agents | null>(null);
  readonly trouble = new Store<string | null>(null);
  readonly notices = new ApprovalNotices();
  readonly #session: Pick<Session, "fetch" | "who">;

  constructor(session: Pick<Session, "fetch" | "who">) {
    this.#session = session;
    session.who.watch((who) => {
      if (who?.admin) void this.look();
      else this.state.value = null; // what one user saw is not for the next
    });
  }

  start(): void {
    void this.#lookAgain();
  }

  /** @returns whether the gateway knows of agents. */
  async look(): Promise<boolean> {
    if (!this.#session.who.value?.admin) return true;
    try {
      const response = await this.#session.fetch(`${PATH}/approvals`);
      const answer: unknown = response.ok ? await response.json() : null;
      this.state.value = response.ok && this.#session.who.value?.admin ? readAgents(answer) : null;
      this.notices.show(this.state.value?.approvals ?? []);
      return response.status !== 404;
    } catch {
      return true; // the list of devices tells that the gateway is away
    }
  }

  answer(approval: Approval, answer: Answer): Promise<void> {
    return this.#send(`approvals/${encodeURIComponent(approval.id)}`, answer);
  }

  /** Ends what they do, and lets them do nothing for so long; 0: lets them again. */
  stop(minutes: number): Promise<void> {
    return this.#send("stop", { minutes });
  }

  async #send(path: string, body: object): Promise<void> {
    try {
      const response = await this.#session.fetch(`${PATH}/${path}`, {
        method: "POST",
        headers: { ["Content-Type"]: "application/json" },
        body: JSON.stringify(body),
      });
      this.trouble.value = response.ok ? null : await problemOf(response);
    } catch (error) {
      this.trouble.value = (error as Error).message;
    }
    await this.look();
  }

  async #lookAgain(): Promise<void> {
    const isAsleep = document.hidden && this.notices.permission.value !== "granted";
    const isThere = isAsleep || (await this.look());
    setTimeout(() => void this.#lookAgain(), isThere ? POLL_MS : RARE_POLL_MS);
  }
}

export function readAgents(answer: unknown): Agents {
  const { approvals, stopped_for: stoppedFor } = isRecord(answer) ? answer : {};
  const seconds = (value: unknown): number => (typeof value === "number" ? value : 0);
  const list: unknown[] = Array.isArray(approvals) ? approvals : [];
  return {
    stoppedForS: seconds(stoppedFor),
    approvals: list
      .filter(isRecord)
      .filter((each) => text(each["id"]) !== "")
      .map((each) => ({
        id: text(each["id"]),
        user: text(each["user"]),
        client: text(each["client"]),
        device: text(each["device"]),
        path: text(each["path"]),
        member: text(each["member"]),
        verb: text(each["verb"]),
        values: JSON.stringify(each["values"]) ?? "",
        why: text(each["why"]),
        expiresInS: seconds(each["expires_in"]),
      })),
  };
}
