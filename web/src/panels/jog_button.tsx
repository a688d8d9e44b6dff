// A button that moves while it is held, by finger, mouse or key; letting go stops, and so does anything odd.
// Layer: web/panels.

import { useEffect, useRef, useState } from "preact/hooks";
import { explain } from "../robot/remote";

const REPEAT_MS = 100;

export interface JogButtonProps {
  label: string;
  sign: string;
  enabled: boolean;
  /** Moves for a moment; called again and again. `isHeld`: whether it is still wanted, after a wait. */
  jog: (isHeld: () => boolean) => Promise<unknown>;
  stop: () => Promise<unknown>;
  fail: (text: string | null) => void;
}

export function JogButton({ label, sign, enabled, jog, stop, fail }: JogButtonProps) {
  const [held, setHeld] = useState(false);
  const latest = useRef({ jog, stop, fail });
  latest.current = { jog, stop, fail };
  const letGo = (): void => setHeld(false);
  useEffect(() => {
    if (!held || !enabled) return;
    let isOver = false;
    let isWaiting = false;
    const send = (): void => {
      if (isWaiting || isOver) return; // no queue of commands that are old when they are carried out
      isWaiting = true;
      latest.current
        .jog(() => !isOver)
        .then(
          () => !isOver && latest.current.fail(null),
          (error: unknown) => (latest.current.fail(explain(error)), letGo()),
        )
        .finally(() => (isWaiting = false));
    };
    send();
    const timer = setInterval(send, REPEAT_MS);
    window.addEventListener("blur", letGo);
    document.addEventListener("visibilitychange", letGo);
    return () => {
      isOver = true;
      clearInterval(timer);
      window.removeEventListener("blur", letGo);
      document.removeEventListener("visibilitychange", letGo);
      // At once, and not behind a command that hangs.
      latest.current.stop().catch((error: unknown) => latest.current.fail(explain(error)));
    };
  }, [held, enabled]);
  return (
    <button
      class={`jog-button ${held ? "is-held" : ""}`}
      type="button"
      aria-label={label}
      aria-pressed={held}
      disabled={!enabled}
      onPointerDown={(event) => {
        if (event.button !== 0) return;
        event.currentTarget.setPointerCapture(event.pointerId);
        setHeld(true);
      }}
      onLostPointerCapture={letGo}
      onContextMenu={(event) => event.preventDefault()}
      onKeyDown={(event) => {
        if (event.code !== "Space" && event.code !== "Enter") return;
        event.preventDefault();
        if (!event.repeat) setHeld(true);
      }}
      onKeyUp={letGo}
      onBlur={letGo}
    >
      {sign}
    </button>
  );
}
