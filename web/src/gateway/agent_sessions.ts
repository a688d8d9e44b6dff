// The sessions of agents and what each has done, asked again every few seconds while shown.
// Layer: web/gateway. Source: GET /api/v1/agents/sessions. What an agent calls itself is its own word: text, and no more.

import { count, isRecord, text } from "./fields";
import { PolledList } from "./polled_list";

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

const POLL_MS = 2_000;

export function agentSessions(): PolledList<AgentSession> {
  return new PolledList("api/v1/agents/sessions", readAgentSessions, POLL_MS);
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
