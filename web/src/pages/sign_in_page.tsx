// The form by which one says who one is, where the gateway asks; and who one is, in the head line.
// Layer: web/pages.

import { useEffect, useRef, useState } from "preact/hooks";
import { t } from "../app/language";
import { useStore } from "../app/store";
import type { Session } from "../gateway/session";
import { Failure } from "../ui/failure";
import { loaded } from "../ui/loaded";
import type { AskPartProps } from "./ask_part";
import { RightsPart } from "./rights_part";

const LoadedAsk = loaded<AskPartProps>(() => import("./ask_part"));

export function SignInPage({ session, done }: { session: Session; done: () => void }) {
  const [name, setName] = useState("");
  const [secret, setSecret] = useState("");
  const [isBusy, setBusy] = useState(false);
  const [failure, setFailure] = useState<string | null>(null);
  const expired = useStore(session.trouble);
  const who = useStore(session.who);
  const first = useRef<HTMLInputElement>(null);
  const second = useRef<HTMLInputElement>(null);
  useEffect(() => first.current?.focus({ preventScroll: true }), []);

  const signIn = async (as: string, shown: string): Promise<void> => {
    setBusy(true);
    setFailure(null);
    try {
      await session.signIn(as, shown);
      done();
    } catch (error) {
      setFailure((error as Error).message);
      setBusy(false);
      second.current?.select();
    }
  };
  return (
    <div class="page page-narrow">
      <form
        class="sign-in panel"
        aria-labelledby="sign-in-title"
        onSubmit={(event) => {
          event.preventDefault();
          if (!isBusy) void signIn(name.trim(), secret);
        }}
      >
        <h1 id="sign-in-title">{t("Sign in")}</h1>
        <p class="sign-in-hint">{t("To the gateway {0}", location.host)}</p>
        <label>
          {t("Name")}
          <input
            ref={first}
            type="text"
            name="username"
            autocomplete="username"
            autocapitalize="none"
            spellcheck={false}
            aria-describedby="sign-in-hint"
            value={name}
            onInput={(event) => setName(event.currentTarget.value)}
          />
        </label>
        <p id="sign-in-hint" class="sign-in-hint">
          {t("Leave empty to sign in with a token.")}
        </p>
        <label>
          {t("Password or token")}
          <input
            ref={second}
            type="password"
            name="password"
            autocomplete="current-password"
            required
            value={secret}
            onInput={(event) => setSecret(event.currentTarget.value)}
          />
        </label>
        <Failure text={failure ?? expired} />
        <button class="button button-main" type="submit" aria-disabled={isBusy}>
          {isBusy ? t("Signing in") : t("Sign in")}
        </button>
      </form>
      {who?.requests && <LoadedAsk session={session} use={(token) => void signIn("", token)} />}
    </div>
  );
}

export function Account({ session, ask }: { session: Session; ask: () => void }) {
  const who = useStore(session.who);
  const [failure, setFailure] = useState<string | null>(null);
  if (!who?.login) return null;
  if (who.user === null)
    return who.roles.length === 0 ? null : (
      <div class="account">
        <RightsPart who={who}>{who.roles.join(", ")}</RightsPart>
        <button class="button" type="button" onClick={ask}>
          {t("Sign in")}
        </button>
      </div>
    );
  const roles = who.roles.length === 0 ? t("no role") : who.roles.join(", ");
  return (
    <div class="account" role="group" aria-label={t("You")}>
      <RightsPart who={who}>
        <strong>{who.user}</strong> <span class="account-roles">{roles}</span>
      </RightsPart>
      {who.session && (
        <button
          class="button"
          type="button"
          onClick={() => void session.signOut().catch((error: unknown) => setFailure((error as Error).message))}
        >
          {t("Sign out")}
        </button>
      )}
      <Failure text={failure} />
    </div>
  );
}
