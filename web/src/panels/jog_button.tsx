// A button that moves while it is held, by finger, mouse or key; letting go stops, and so does anything odd.
// Layer: web/panels.

import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import { isLeftUp, onLetGo } from "../robot/let_go";
import { explain } from "../robot/remote";
import { HeldJog } from "./held_jog";
import type { JogMeans } from "./held_jog";

export interface JogButtonProps extends Pick<JogMeans, "jog" | "mayGoOn" | "stop"> {
  label: string;
  sign: string;
  enabled: boolean;
  fail: (text: string | null) => void;
}

export function JogButton({ label, sign, enabled, jog, mayGoOn, stop, fail }: JogButtonProps) {
  const [held, setHeld] = useState(false);
  const latest = useRef({ jog, mayGoOn, stop, fail });
  latest.current = { jog, mayGoOn, stop, fail };
  const hold = useMemo(
    () =>
      new HeldJog({
        jog: (isHeld) => latest.current.jog(isHeld),
        mayGoOn: () => latest.current.mayGoOn(),
        stop: () => latest.current.stop(),
        fail: (error) => latest.current.fail(explain(error)),
        done: () => latest.current.fail(null),
        changed: setHeld,
      }),
    [],
  );
  const letGo = (): void => hold.end();
  useEffect(() => {
    if (!enabled) hold.end();
  }, [enabled, hold]);
  useEffect(() => {
    const forget = onLetGo(letGo);
    return () => {
      forget();
      letGo();
    };
  }, [hold]);
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
        hold.begin();
      }}
      onPointerMove={(event) => isLeftUp(event) && letGo()}
      onLostPointerCapture={letGo}
      onContextMenu={(event) => event.preventDefault()}
      onKeyDown={(event) => {
        if (event.code !== "Space" && event.code !== "Enter") return;
        event.preventDefault();
        if (!event.repeat) hold.begin();
      }}
      onKeyUp={letGo}
      onBlur={letGo}
    >
      {sign}
    </button>
  );
}
