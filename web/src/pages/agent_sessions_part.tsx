// What agents do, for those who decide on them: sessions and last commands. Closed at first; asks only while it is open.
// Layer: web/pages.

import { useEffect, useState } from "preact/hooks";
import { language, t } from "../app/language";
import { useNow, useStore } from "../app/store";
import { AgentSessionList, sessionsOf } from "../gateway/agent_sessions";
import type { AgentCommand, AgentSession, AgentSessionsState } from "../gateway/agent_sessions";
import type { AgentsDesk } from "../gateway/agents";
import { Folded } from "../ui/folded";
import { clockTime, ended, span } from "../ui/words";

export function AgentSessionsPart({ agents }: { agents: AgentsDesk }) {
  if (!useStore(agents.state)) return null;
  return (
    <Folded name="agent-sessions" summary={t("What agents do")}>
      <Sessions />
    </Folded>
  );
}

function Sessions() {
  const [list] = useState(() => new AgentSessionList());
  useEffect(() => {
    list.start();
    return () => list.stop();
  }, [list]);
  const state = useStore(list.state);
  const now = useNow(1_000);
  return (
    <div data-agent-sessions={state.kind}>
      <p class="note" role="status">
        {headline(state)}
      </p>
      {state.kind === "loading" && <span class="bone" aria-hidden="true" />}
      <ul>
        {sessionsOf(state)?.map((each, row) => (
          <SessionRow key={row} session={each} now={now} />
        ))}
      </ul>
    </div>
  );
}

/** Changes rarely, so that it can be announced: the numbers are below. */
function headline(state: AgentSessionsState): string {
  if (state.kind === "loading") return t("Asking the gateway for them.");
  if (state.kind === "denied") return t("You may not see them: {0}", ended(state.reason));
  if (state.kind === "away") {
    const below = state.sessions && state.sessions.length > 0 ? ` ${t("Below is what it said last.")}` : "";
    const since = clockTime(state.since);
    return `${t("The gateway has not told them since {0}: {1}", since, ended(state.reason))}${below}`;
  }
  if (state.sessions.length === 0) return t("The gateway knows of no agent now.");
  return t("The agents that were here last, and the last commands of each.");
}

function SessionRow({ session, now }: { session: AgentSession; now: number }) {
  const { user, client, program, begunAt, usedAt, ended, reads, commands, lastCommands } = session;
  const name = user || client || t("unknown");
  const begun = new Date(begunAt).toLocaleString(language);
  return (
    <li class="agent-session">
      {/* What it calls itself stands apart, so that it cannot be read as what the page says. */}
      <h2>
        {name} {program !== "" && <bdi class="code">{program}</bdi>}{" "}
        {ended && <span class="found-mark">{t("ended")}</span>}
      </h2>
      <p class="note">
        {user !== "" && `${client} · `}
        {t("since {0}, last heard {1} ago; reads: {2}, commands: {3}", begun, span(now - usedAt), reads, commands)}
      </p>
      {lastCommands.length > 0 && <Commands name={name} commands={lastCommands} />}
    </li>
  );
}

/** With its roles said outright: on a narrow screen its rows are laid out as blocks, and browsers would forget them. */
function Commands({ name, commands }: { name: string; commands: AgentCommand[] }) {
  return (
    <table class="ledger" role="table" aria-label={t("Last commands of {0}", name)}>
      <thead role="rowgroup">
        <tr role="row">
          {["Time", "Tool", "Member", "Values", "State"].map((column) => (
            <th key={column} role="columnheader" scope="col">
              {t(column)}
            </th>
          ))}
        </tr>
      </thead>
      <tbody role="rowgroup">
        {commands.map((each, row) => (
          <CommandRow key={row} command={each} />
        ))}
      </tbody>
    </table>
  );
}

function CommandRow({ command }: { command: AgentCommand }) {
  const { at, tool, device, path, values, state, detail } = command;
  return (
    <tr role="row" class={`is-${state}`} data-state={state}>
      <th role="rowheader" scope="row" title={new Date(at).toLocaleString(language)}>
        {clockTime(at)}
      </th>
      <td role="cell" data-label={t("Tool")}>
        {tool}
      </td>
      <td role="cell" data-label={t("Member")}>
        {path === "" ? device : `${device} · ${path}`}
      </td>
      <td role="cell" class="code" data-label={t("Values")}>
        <span class="agent-values" title={values}>
          {values}
        </span>
      </td>
      <td role="cell" data-label={t("State")}>
        {detail === "" ? t(state) : `${t(state)}: ${detail}`}
      </td>
    </tr>
  );
}
