// What agents wait to be allowed to do, deciding on it, and stopping them all.
// Layer: web/gateway. Source: /api/v1/agents. A gateway that has no agents answers 404.

import { t } from "../app/language";
import { Store } from "../app/store";
import { ApprovalNotices } from "./approval_notices";
import { isRecord, text } from "./fields";
import { reasonOf } from "./poller";
import { expectOk, problemOf } from "./answer";
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
  /** Milliseconds, as Date.now() counts them. */
  expiresAt: number;
}

export interface Agents {
  approvals: readonly Approval[];
  /** Milliseconds, as Date.now() counts them; 0, or what is past: they are not stopped. */
  stoppedUntil: number;
}

/** The gateway has not said how things are since then, and why. */
export interface Silence {
  since: number;
  reason: string;
}

export type Answer = { answer: "once" | "deny" } | { answer: "minutes"; minutes: number };

const PATH = "api/v1/agents";
const POLL_MS = 2_000;
const RARE_POLL_MS = 60_000;
const TIMEOUT_MS = 5_000;
const STOP_TIMEOUT_MS = 4_000; // the gateway waits 2 s for the answers of devices

export class AgentsDesk {
  /** null: the gateway has none, or this user does not decide. */
  readonly state = new Store<Agents | null>(null);
  /** What is known is as old as this says; null: it is of now. */
  readonly silence = new Store<Silence | null>(null);
  readonly trouble = new Store<string | null>(null);
  readonly notices = new ApprovalNotices();
  readonly #session: Pick<Session, "fetch" | "who">;
  /** Objects of the stop that holds whose devices have not said that they are safe. */
  readonly #unsafe = new Map<string, Unsafe>();
  #asked = 0;
  #heardAt = Date.now();

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
    const asked = ++this.#asked;
    try {
      const signal = AbortSignal.timeout(TIMEOUT_MS);
      const response = await this.#session.fetch(`${PATH}/approvals`, { signal });
      // It does not say that there are none: it is broken, or asked too often.
      if (response.status >= 500 || response.status === 429) throw new Error(await problemOf(response));
      const answer: unknown = response.ok ? await response.json() : null;
      if (asked !== this.#asked) return true; // asked again meanwhile, or stopped
      this.#heardAt = Date.now();
      this.silence.value = null;
      this.state.value = response.ok && this.#session.who.value?.admin ? readAgents(answer) : null;
      this.notices.show(this.state.value?.approvals ?? []);
      return response.status !== 404;
    } catch (error) {
      if (asked === this.#asked) this.silence.value = { since: this.#heardAt, reason: reasonOf(error) };
      return true;
    }
  }

  async answer(approval: Approval, answer: Answer): Promise<void> {
    await this.#send(`approvals/${encodeURIComponent(approval.id)}`, answer);
  }

  /**
   * Ends what they do, and lets them do nothing for so long.
   * @returns in words, which devices have not answered yet that they are safe, also to a stop before that still holds; nothing: there
   *   are none.
   * @throws (rejects) why they may go on, or which devices may not be safe, and why.
   */
  async stop(minutes: number): Promise<string | void> {
    if (!(this.state.value && this.state.value.stoppedUntil > Date.now())) this.#unsafe.clear();
    const response = await this.#post("stop", { minutes }, STOP_TIMEOUT_MS);
    if (this.state.value) this.state.value = { ...this.state.value, stoppedUntil: Date.now() + minutes * 60_000 };
    void this.look();
    this.#learnSafe(await response.json());
    return tellStopped(this.#unsafe);
  }

  async letGoOn(): Promise<void> {
    if (await this.#send("stop", { minutes: 0 })) this.#unsafe.clear();
  }

  #learnSafe(answer: unknown): void {
    const devices: unknown[] = isRecord(answer) && Array.isArray(answer["devices"]) ? answer["devices"] : [];
    for (const each of devices.filter(isRecord)) {
      const device = text(each["device"]);
      const error = each["error"];
      const object = `${device}/${text(each["refused"] ?? each["sent"] ?? each["stopped"])}`;
      if (isRecord(error)) this.#unsafe.set(object, { device, why: text(error["message"]) });
      else if (text(each["unanswered"]) !== "") this.#unsafe.set(object, { device, why: null });
      else this.#unsafe.delete(object);
    }
  }

  /** What fails is told as trouble. @returns whether it did not. */
  async #send(path: string, body: object): Promise<boolean> {
    try {
      await this.#post(path, body, TIMEOUT_MS);
      this.trouble.value = null;
    } catch (error) {
      this.trouble.value = (error as Error).message;
    }
    await this.look();
    return this.trouble.value === null;
  }

  /** @throws Error (rejects), for people. */
  async #post(path: string, body: object, timeoutMs: number): Promise<Response> {
    const init = {
      method: "POST",
      headers: { ["Content-Type"]: "application/json" },
      body: JSON.stringify(body),
      signal: AbortSignal.timeout(timeoutMs),
    };
    const response = await this.#session.fetch(`${PATH}/${path}`, init).catch((error: unknown) => {
      throw new Error(reasonOf(error), { cause: error });
    });
    return expectOk(response);
  }

  async #lookAgain(): Promise<void> {
    const isAsleep = document.hidden && this.notices.permission.value !== "granted";
    const isThere = isAsleep || (await this.look());
    setTimeout(() => void this.#lookAgain(), isThere ? POLL_MS : RARE_POLL_MS);
  }
}

interface Unsafe {
  device: string;
  /** null: it has not answered. */
  why: string | null;
}

/** See AgentsDesk.stop(). */
function tellStopped(unsafe: ReadonlyMap<string, Unsafe>): string | void {
  const silent = new Set<string>();
  const refused = new Set<string>();
  for (const { device, why } of unsafe.values())
    if (why === null) silent.add(device);
    else refused.add(t("{0} refuses: {1}", device, why));
  const words = silent.size > 0 ? [t("agents are stopped; not answered yet: {0}", [...silent].join(", "))] : [];
  if (refused.size > 0) throw new Error([...refused, ...words].join("; "));
  return words[0];
}

export function readAgents(answer: unknown, now = Date.now()): Agents {
  const { approvals, stopped_for: stoppedFor } = isRecord(answer) ? answer : {};
  const after = (seconds: unknown): number => (typeof seconds === "number" ? now + seconds * 1000 : now);
  const list: unknown[] = Array.isArray(approvals) ? approvals : [];
  return {
    stoppedUntil: stoppedFor === 0 ? 0 : after(stoppedFor), // a page whose clock ticks by the second would say "for 0 s"
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
        expiresAt: after(each["expires_in"]),
      })),
  };
}
