// The sessions of agents and what each has done, asked again every few seconds while shown.
// Layer: web/gateway. Source: GET /api/v1/agents/sessions. What an agent calls itself is its own word: text, and no more.

import { Store } from "../app/store";
import { count, isRecord, text } from "./fields";
import { Poller, reasonOf } from "./poller";
import { problemOf } from "./answer";
import { session } from "./session";

export interface AgentCommand {
  /** Milliseconds, as Date.now() counts them. */
  at: number;
  tool: string;
  device: string;
  path: string;
  /** As JSON, which the gateway may have cut. */
  values: string;
  /** "running", "done" or "failed". */
  state: string;
  /** Why it failed. */
  detail: string;
}

export interface AgentSession {
  /** Empty: nobody has signed in. */
  user: string;
  client: string;
  /** What the agent calls itself; it may be anything. */
  program: string;
  /** Milliseconds, as Date.now() counts them. */
  begunAt: number;
  usedAt: number;
  ended: boolean;
  reads: number;
  commands: number;
  /** The newest first. */
  lastCommands: AgentCommand[];
}

export type AgentSessionsState =
  | { kind: "loading" }
  | { kind: "known"; sessions: AgentSession[] }
  /** The gateway refuses to tell. */
  | { kind: "denied"; reason: string }
  /** It does not answer; `sessions` are what it said last, null if it never did. */
  | { kind: "away"; since: number; reason: string; sessions: AgentSession[] | null };

const POLL_MS = 2_000;

export class AgentSessionList {
  readonly state = new Store<AgentSessionsState>({ kind: "loading" });
  readonly #poller = new Poller<AgentSessionsState>({
    ask: (signal) => this.#fetch(signal),
    answered: (next) => (this.state.value = next),
    failed: (error) => (this.state.value = awayAfter(this.state.value, error, Date.now())),
    period: POLL_MS,
    hiddenPeriod: null, // nobody looks at a hidden tab
  });

  start(): void {
    this.#poller.start();
  }

  stop(): void {
    this.#poller.stop();
  }

  async #fetch(signal: AbortSignal): Promise<AgentSessionsState> {
    const response = await session.fetch("api/v1/agents/sessions", { signal });
    if (response.ok) return { kind: "known", sessions: readAgentSessions(await response.json()) };
    const reason = await problemOf(response);
    if (response.status === 401 || response.status === 403) return { kind: "denied", reason };
    throw new Error(reason);
  }
}

/** The state when asking has failed: it keeps what was known. */
export function awayAfter(before: AgentSessionsState, error: unknown, now: number): AgentSessionsState {
  return {
    kind: "away",
    since: before.kind === "away" ? before.since : now,
    reason: reasonOf(error),
    sessions: sessionsOf(before),
  };
}

export function sessionsOf(state: AgentSessionsState): AgentSession[] | null {
  return state.kind === "known" || state.kind === "away" ? state.sessions : null;
}

/** In the order of the gateway: the latest used first. @throws Error when it is no list: that is not "no agents". */
export function readAgentSessions(answer: unknown, now = Date.now()): AgentSession[] {
  const list = isRecord(answer) ? answer["sessions"] : null;
  if (!Array.isArray(list)) throw new Error('the answer of the gateway has no list "sessions"');
  const before = (seconds: unknown): number => now - count(seconds) * 1000;
  return list.filter(isRecord).map((each) => ({
    user: text(each["user"]),
    client: text(each["client"]),
    program: text(each["program"]),
    begunAt: before(each["begun_ago"]),
    usedAt: before(each["used_ago"]),
    ended: each["ended"] === true,
    reads: count(each["reads"]),
    commands: count(each["commands"]),
    lastCommands: recordsIn(each["last_commands"])
      .map((command) => ({
        at: before(command["ago"]),
        tool: text(command["tool"]),
        device: text(command["device"]),
        path: text(command["path"]),
        values: text(command["values"]),
        state: text(command["state"]),
        detail: text(command["detail"]),
      }))
      .reverse(),
  }));
}

function recordsIn(value: unknown): Record<string, unknown>[] {
  return Array.isArray(value) ? value.filter(isRecord) : [];
}
