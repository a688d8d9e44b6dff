// Below the form to sign in: asking somebody for access, where the gateway has somebody who decides.
// Layer: web/pages.

import { useEffect, useMemo, useState } from "preact/hooks";
import { t } from "../app/language";
import { useStore } from "../app/store";
import { AccessAsk } from "../gateway/access_ask";
import type { Session } from "../gateway/session";
import { Failure } from "../ui/failure";

export interface AskPartProps {
  session: Session;
  use: (token: string) => void;
}

export default function AskPart({ session, use }: AskPartProps) {
  const ask = useMemo(() => new AccessAsk(session), [session]);
  useEffect(() => () => ask.dispose(), [ask]);
  const state = useStore(ask.state);
  const [name, setName] = useState("");
  const [reason, setReason] = useState("");
  if (state.kind === "waiting")
    return (
      <p class="panel ask-part" role="status" data-ask="waiting">
        {t("Asked for access as {0}. This page waits for an answer.", state.name)}
      </p>
    );
  if (state.kind === "approved")
    return (
      <div class="panel ask-part" role="status" data-ask="approved">
        <p>{t("Access was given. This token is shown once: keep it, it signs you in.")}</p>
        <p>
          <code class="ask-token">{state.token}</code>
        </p>
        <button class="button" type="button" onClick={() => use(state.token)}>
          {t("Sign in with this token")}
        </button>
      </div>
    );
  const trouble =
    state.kind === "failed"
      ? state.why
      : state.kind === "refused"
        ? state.why === "denied"
          ? t("The request was denied.")
          : t("Nobody has answered the request in time.")
        : null;
  return (
    <details class="panel ask-part">
      <summary>{t("Ask for access")}</summary>
      <form
        class="ask-form"
        aria-label={t("Ask for access")}
        onSubmit={(event) => {
          event.preventDefault();
          if (state.kind !== "asking") void ask.ask(name.trim(), reason.trim());
        }}
      >
        <label>
          {t("Ask as")}
          <input
            type="text"
            required
            maxLength={64}
            autocomplete="off"
            autocapitalize="none"
            spellcheck={false}
            value={name}
            onInput={(event) => setName(event.currentTarget.value)}
          />
        </label>
        <label>
          {t("What for")}
          <input type="text" maxLength={200} value={reason} onInput={(event) => setReason(event.currentTarget.value)} />
        </label>
        <Failure text={trouble} />
        <button class="button" type="submit" aria-disabled={state.kind === "asking"}>
          {t("Ask for access")}
        </button>
      </form>
    </details>
  );
}
