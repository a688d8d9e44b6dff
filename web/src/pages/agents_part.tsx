// What agents ask to be allowed, for those who decide on it, wherever they are in the page; and the stop for all agents.
// Layer: web/pages. Nothing that is asked moves the page: who is about to press something there must not hit something else.

import { t } from "../app/language";
import { useNow, useStore } from "../app/store";
import { StopPress } from "../board/stop";
import type { AgentsDesk, Answer, Approval } from "../gateway/agents";
import { Failure } from "../ui/failure";
import { useMeant, useSettled } from "../ui/use_settled";
import { clockTime, span } from "../ui/words";

const GRANT_MINUTES = 10;
const STOP_MINUTES = 10;

export function AgentsPart({ agents }: { agents: AgentsDesk }) {
  const state = useStore(agents.state);
  const silence = useStore(agents.silence);
  const trouble = useStore(agents.trouble);
  const permission = useStore(agents.notices.permission);
  const now = useNow(1_000);
  const approvals = state?.approvals ?? [];
  const isSettled = useSettled([trouble, ...approvals.map(({ id }) => id)].join());
  if (!state) return null;
  const isStopped = state.stoppedUntil > now;
  return (
    <section class="agents-part" aria-label={t("Agents")} data-approvals={approvals.length}>
      <div class="agents-line">
        <StopPress send={() => agents.stop(STOP_MINUTES)} label={t("Stop all agents")} words="" />
        <button class="button" type="button" disabled={!isStopped} onClick={() => void agents.letGoOn()}>
          {t("Let agents go on")}
        </button>
        {permission === "default" && (
          <button class="button" type="button" onClick={() => void agents.notices.ask()}>
            {t("Notify me of requests")}
          </button>
        )}
        <p class="agents-words" role="status">
          {isStopped && t("Agents are stopped for {0}.", span(state.stoppedUntil - now))}{" "}
          {silence && (
            <strong data-silence>{t("Not heard of since {0}: {1}", clockTime(silence.since), silence.reason)}</strong>
          )}
        </p>
      </div>
      <div class="agents-asked">
        <Failure text={trouble} />
        <ul>
          {approvals.map((each) => (
            <ApprovalRow
              key={each.id}
              approval={each}
              leftMs={each.expiresAt - now}
              isSettled={isSettled}
              answer={(given) => void agents.answer(each, given)}
            />
          ))}
        </ul>
      </div>
    </section>
  );
}

interface ApprovalRowProps {
  approval: Approval;
  leftMs: number;
  isSettled: () => boolean;
  answer: (given: Answer) => void;
}

function ApprovalRow({ approval, leftMs, isSettled, answer }: ApprovalRowProps) {
  const { id, user, client, device, path, member, verb, values, why } = approval;
  const meant = useMeant(isSettled);
  const allow = (given: Answer) => meant(() => answer(given));
  return (
    <li class="approval" data-approval={id}>
      <p role="alert">
        {t("The agent of {0} asks to do this:", user === "" ? client : user)}{" "}
        <strong>
          {device} · {path}.{member}
        </strong>{" "}
        ({verb})
      </p>
      <pre class="code approval-values">{values}</pre>
      <p>{why === "" ? t("It does not say why.") : t("It says why: {0}", why)}</p>
      <p class="note">
        {client}; {t("still {0} to answer", span(leftMs))}
      </p>
      <div class="row-line">
        <button class="button" type="button" {...allow({ answer: "once" })}>
          {t("Allow once")}
        </button>
        <button class="button" type="button" {...allow({ answer: "minutes", minutes: GRANT_MINUTES })}>
          {t("Allow for {0} minutes", GRANT_MINUTES)}
        </button>
        <button class="button" type="button" onClick={() => answer({ answer: "deny" })}>
          {t("Deny")}
        </button>
      </div>
    </li>
  );
}
