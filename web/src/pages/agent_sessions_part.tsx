// What agents do, for those who decide on them: sessions and last commands. Closed at first; asks only while it is open.
// Layer: web/pages.

import { language, t } from "../app/language";
import { useNow, useStore } from "../app/store";
import { agentSessions } from "../gateway/agent_sessions";
import type { AgentCommand, AgentSession } from "../gateway/agent_sessions";
import type { AgentsDesk } from "../gateway/agents";
import { itemsOf } from "../gateway/polled_list";
import { Folded } from "../ui/folded";
import { Ledger } from "../ui/ledger";
import { clockTime, span } from "../ui/words";
import { headline, usePolled } from "./polled";

export function AgentSessionsPart({ agents }: { agents: AgentsDesk }) {
  if (!useStore(agents.state)) return null;
  return (
    <Folded name="agent-sessions" summary={t("What agents do")}>
      <Sessions />
    </Folded>
  );
}

function Sessions() {
  const state = usePolled(agentSessions);
  const now = useNow(1_000);
  return (
    <div data-agent-sessions={state.kind}>
      <p class="note" role="status">
        {headline(state, known)}
      </p>
      {state.kind === "loading" && <span class="bone" aria-hidden="true" />}
      <ul>
        {itemsOf(state)?.map((each, row) => (
          <SessionRow key={row} session={each} now={now} />
        ))}
      </ul>
    </div>
  );
}

function known(sessions: AgentSession[]): string {
  if (sessions.length === 0) return t("The gateway knows of no agent now.");
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

const COLUMNS = ["Time", "Tool", "Member", "Values", "State"];

function Commands({ name, commands }: { name: string; commands: AgentCommand[] }) {
  return (
    <Ledger label={t("Last commands of {0}", name)} columns={COLUMNS}>
      {commands.map((each, row) => (
        <CommandRow key={row} command={each} />
      ))}
    </Ledger>
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
