// Whether the device still answers: asked twice a second while somebody looks, so that a frozen one is seen within a second.
// Layer: web/live.

import { useEffect, useState } from "preact/hooks";
import type { Remote } from "../robot/remote";
import { openFeeds } from "./feed";

const EVERY_MS = 400;
const SILENT_MS = 500;
const PATIENCE_MS = 10_000; // what waits longer is asked anew

/** Milliseconds since the device should have answered; null while it does, and without connection. */
export function usePulse(object: Remote | null): number | null {
  const [silent, setSilent] = useState<number | null>(null);
  useEffect(() => {
    setSilent(null);
    if (!object) return;
    let askedAt: number | null = null;
    let isOver = false;
    const ask = (): void => {
      askedAt = performance.now();
      const answered = (): void => void (askedAt = null);
      object.ping(PATIENCE_MS).then(answered, answered); // a refusal is an answer
    };
    const timer = setInterval(() => {
      if (isOver || document.hidden) return;
      const waits = Math.max(askedAt === null ? 0 : performance.now() - askedAt, stillness(object));
      setSilent(waits > SILENT_MS ? Math.floor(waits / 100) * 100 : null);
      if (askedAt === null || performance.now() - askedAt > PATIENCE_MS) ask();
    }, EVERY_MS / 4);
    return () => {
      isOver = true;
      clearInterval(timer);
    };
  }, [object]);
  return silent;
}

/** A gateway may answer for the device: how long all is old that came regularly from this object; 0 while any comes. */
function stillness(object: Remote): number {
  const now = performance.now();
  const regular = openFeeds().filter((feed) => feed.object === object && feed.pace.periodMs !== null);
  if (regular.length === 0 || !regular.every(({ pace }) => pace.isStale(now))) return 0;
  return Math.min(...regular.map(({ pace }) => pace.ageMs(now) ?? 0));
}
