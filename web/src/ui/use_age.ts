// How old a value is, once no newer one comes.
// Layer: web/ui.

import { useEffect, useRef, useState } from "preact/hooks";
import { staleAge } from "./words";

const LOOK_MS = 100;

/** "3 s old" for what last came at `heardAt()`, by performance.now(); null while it still comes, or never did. */
export function useAge(heardAt: () => number | null): string | null {
  const [age, setAge] = useState<string | null>(null);
  const latest = useRef(heardAt);
  latest.current = heardAt;
  useEffect(() => {
    const timer = setInterval(() => {
      const at = latest.current();
      setAge(at === null ? null : staleAge(performance.now() - at));
    }, LOOK_MS);
    return () => clearInterval(timer);
  }, []);
  return age;
}
