// What the rows of all member kinds share: their head line, and one running action with its failure.
// Layer: web/members.

import { useCallback, useEffect, useRef, useState } from "preact/hooks";
import type { Route } from "../app/router";
import { isLocked } from "../robot/control";
import { explain } from "../robot/remote";
import type { Member, Remote } from "../robot/remote";
import { flowing } from "../ui/words";

/** What somebody calls by hand may take long; who holds a lease waits shorter where nothing is said. */
export const PATIENT = { timeout: 15_000 };

export interface MemberRowProps {
  object: Remote;
  member: Member;
  live: boolean;
  route: Route & { page: "service" };
}

export function RowHead({ member, signature }: { member: Member; signature?: string }) {
  return (
    <>
      <div class="row-head">
        <h3 class="member-name">{member.name}</h3>
        <code class="member-type">{signature ?? member.type}</code>
        {member.modifiers.map((modifier) => (
          <span key={modifier} class="modifier">
            {modifier}
          </span>
        ))}
      </div>
      {member.documentation !== "" && <p class="note row-documentation">{flowing(member.documentation)}</p>}
    </>
  );
}

export interface Action {
  busy: boolean;
  failure: string | null;
  /** It failed because this page does not have the right to command. */
  isLocked: boolean;
  run(work: () => Promise<void>): void;
  fail(text: string): void;
}

/** One thing at a time: `busy` while it runs, `failure` until the next begins. */
export function useAction(): Action {
  const [busy, setBusy] = useState(false);
  const [failure, setFailure] = useState<string | null>(null);
  const [wasLocked, setLocked] = useState(false);
  const mounted = useRef(true);
  useEffect(() => {
    mounted.current = true;
    return () => void (mounted.current = false);
  }, []);
  const run = useCallback((work: () => Promise<void>) => {
    setBusy(true);
    setFailure(null);
    setLocked(false);
    work()
      .catch((error: unknown) => {
        if (!mounted.current) return;
        setFailure(explain(error));
        setLocked(isLocked(error));
      })
      .finally(() => {
        if (mounted.current) setBusy(false);
      });
  }, []);
  return { busy, failure, isLocked: wasLocked, run, fail: setFailure };
}
