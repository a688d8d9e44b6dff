// How old a value is, once no newer one comes.
// Layer: web/ui.

import { useEffect, useRef, useState } from "preact/hooks";
import { stale_age } from "./words";

const LOOK_MS = 100;

/** "3 s old" for what last came at `heard_at()`, by performance.now(); null while it still comes, or never did. */
export function useAge(heard_at: () => number | null): string | null {
  const [age, set_age] = useState<string | null>(null);
  const latest = useRef(heard_at);
  latest.current = heard_at;
  useEffect(() => {
    const timer = setInterval(() => {
      const at = latest.current();
      set_age(at === null ? null : stale_age(performance.now() - at));
    }, LOOK_MS);
    return () => clearInterval(timer);
  }, []);
  return age;
}
