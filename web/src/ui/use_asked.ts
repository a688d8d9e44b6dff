// One answer of the gateway, asked for once, and again when what is asked changes.
// Layer: web/ui.

import { useEffect, useState } from "preact/hooks";

import { reasonOf } from "../gateway/poller";

const DEADLINE_MS = 10_000;

/** `key`: another one asks again. Until the new answer is there, the one before stays. */
export function useAsked<T>(
  ask: (signal: AbortSignal) => Promise<T>,
  key: string,
): { answer: T | null; failure: string | null } {
  const [shown, setShown] = useState<{ answer: T | null; failure: string | null }>({ answer: null, failure: null });
  useEffect(() => {
    const gone = new AbortController();
    ask(AbortSignal.any([gone.signal, AbortSignal.timeout(DEADLINE_MS)])).then(
      (answer) => !gone.signal.aborted && setShown({ answer, failure: null }),
      (error: unknown) => !gone.signal.aborted && setShown({ answer: null, failure: reasonOf(error) }),
    );
    return () => gone.abort();
  }, [key]);
  return shown;
}
