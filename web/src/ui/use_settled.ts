// Presses that answer somebody: not one that was meant for what stood there before.
// Layer: web/ui.

import { useRef } from "preact/hooks";

const SETTLED_MS = 700;

/** @returns whether what `shown` names has stood where it is for long enough to be what somebody meant. */
export function useSettled(shown: string): () => boolean {
  const last = useRef({ shown: "", at: 0 });
  if (shown !== last.current.shown) last.current = { shown, at: performance.now() };
  return () => performance.now() - last.current.at > SETTLED_MS;
}

/** @returns handlers of a button that does `act` only where the press began, and ends, while all is settled. */
export function useMeant(isSettled: () => boolean): (act: () => void) => {
  onPointerDown: () => void;
  onClick: (event: MouseEvent) => void;
} {
  const isMeant = useRef(true);
  return (act) => ({
    onPointerDown: () => void (isMeant.current = isSettled()),
    onClick: ({ detail }) => {
      if ((detail === 0 || isMeant.current) && isSettled()) act();
    },
  });
}
