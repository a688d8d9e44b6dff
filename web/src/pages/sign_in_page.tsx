// The form by which one says who one is, where the gateway asks; and who one is, in the head line.
// Layer: web/pages.

import { useEffect, useRef, useState } from "preact/hooks";
import { useStore } from "../app/store";
import type { Session } from "../gateway/session";
import { Failure } from "../ui/failure";

export function SignInPage({ session, done }: { session: Session; done: () => void }) {
  const [name, setName] = useState("");
  const [secret, setSecret] = useState("");
  const [isBusy, setBusy] = useState(false);
  const [failure, setFailure] = useState<string | null>(null);
  const expired = useStore(session.trouble);
  const first = useRef<HTMLInputElement>(null);
  const second = useRef<HTMLInputElement>(null);
  useEffect(() => first.current?.focus(), []);

  const signIn = async (): Promise<void> => {
    setBusy(true);
    setFailure(null);
    try {
      await session.signIn(name.trim(), secret);
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
          if (!isBusy) void signIn();
        }}
      >
        <h1 id="sign-in-title">Sign in</h1>
        <label>
          Name
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
          Empty, if you have a token.
        </p>
        <label>
          Password or token
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
        <button class="button" type="submit" aria-disabled={isBusy}>
          {isBusy ? "Signing in" : "Sign in"}
        </button>
      </form>
    </div>
  );
}

export function Account({ session, ask }: { session: Session; ask: () => void }) {
  const who = useStore(session.who);
  const [failure, setFailure] = useState<string | null>(null);
  if (!who?.login) return null;
  if (who.user === null)
    return who.roles.length === 0 ? null : (
      <button class="button" type="button" onClick={ask}>
        Sign in
      </button>
    );
  const roles = who.roles.length === 0 ? "no role" : who.roles.join(", ");
  return (
    <div class="account" role="group" aria-label="You">
      <p>
        <strong>{who.user}</strong> <span class="account-roles">{roles}</span>
      </p>
      {who.session && (
        <button
          class="button"
          type="button"
          onClick={() => void session.signOut().catch((error: unknown) => setFailure((error as Error).message))}
        >
          Sign out
        </button>
      )}
      <Failure text={failure} />
    </div>
  );
}
