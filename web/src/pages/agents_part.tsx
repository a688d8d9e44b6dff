// What agents ask to be allowed, for those who decide on it, wherever they are in the page; and the stop for all agents.
// Layer: web/pages.

import { t } from "../app/language";
import { useStore } from "../app/store";
import type { AgentsDesk, Answer, Approval } from "../gateway/agents";
import { Failure } from "../ui/failure";
import { span } from "../ui/words";

const GRANT_MINUTES = 10;
const STOP_MINUTES = 10;

export function AgentsPart({ agents }: { agents: AgentsDesk }) {
  const state = useStore(agents.state);
  const trouble = useStore(agents.trouble);
  const permission = useStore(agents.notices.permission);
  if (!state) return null;
  const { approvals, stoppedForS } = state;
  return (
    <section class="agents-part" aria-label={t("Agents")} data-approvals={approvals.length}>
      <ul>
        {approvals.map((each) => (
          <ApprovalRow key={each.id} approval={each} answer={(given) => void agents.answer(each, given)} />
        ))}
      </ul>
      <div class="row-line">
        {stoppedForS > 0 ? (
          <>
            <p role="status">{t("Agents are stopped for {0}.", span(stoppedForS * 1000))}</p>
            <button class="button" type="button" onClick={() => void agents.stop(0)}>
              {t("Let agents go on")}
            </button>
          </>
        ) : (
          <button class="button agents-stop" type="button" onClick={() => void agents.stop(STOP_MINUTES)}>
            {t("Stop all agents")}
          </button>
        )}
        {permission === "default" && (
          <button class="button" type="button" onClick={() => void agents.notices.ask()}>
            {t("Notify me of requests")}
          </button>
        )}
      </div>
      <Failure text={trouble} />
    </section>
  );
}

function ApprovalRow({ approval, answer }: { approval: Approval; answer: (given: Answer) => void }) {
  const { id, user, client, device, path, member, verb, values, why, expiresInS } = approval;
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
        {client}; {t("still {0} to answer", span(expiresInS * 1000))}
      </p>
      <div class="row-line">
        <button class="button" type="button" onClick={() => answer({ answer: "once" })}>
          {t("Allow once")}
        </button>
        <button class="button" type="button" onClick={() => answer({ answer: "minutes", minutes: GRANT_MINUTES })}>
          {t("Allow for {0} minutes", GRANT_MINUTES)}
        </button>
        <button class="button" type="button" onClick={() => answer({ answer: "deny" })}>
          {t("Deny")}
        </button>
      </div>
    </li>
  );
}
