// A stick on the screen: drag its knob, let go and it is back in the middle.
// Layer: web/panels.

import { useRef } from "preact/hooks";
import { isLeftUp } from "../robot/let_go";

export interface StickMoves {
  /** A finger or a button of the mouse is down on it. */
  press: () => void;
  /** Right and up are positive, -1 to 1. */
  move: (x: number, y: number) => void;
  release: () => void;
}

export interface StickProps extends StickMoves {
  label: string;
  x: number;
  y: number;
}

export function StickPad({ label, x, y, press, move, release }: StickProps) {
  const held = useRef<number | null>(null);
  const follow = (event: PointerEvent): void => {
    if (held.current !== event.pointerId) return;
    const box = (event.currentTarget as Element).getBoundingClientRect();
    const at = (offset: number, size: number): number => Math.min(1, Math.max(-1, (2 * offset) / size - 1));
    move(at(event.clientX - box.left, box.width), -at(event.clientY - box.top, box.height));
  };
  const letGo = (): void => {
    held.current = null;
    release();
  };
  return (
    <div
      class="stick"
      role="img"
      aria-label={label}
      onPointerDown={(event) => {
        if (event.button !== 0) return;
        event.currentTarget.setPointerCapture(event.pointerId);
        held.current = event.pointerId;
        press();
        follow(event);
      }}
      onPointerMove={(event) => (isLeftUp(event) ? letGo() : follow(event))}
      onLostPointerCapture={letGo}
      onContextMenu={(event) => event.preventDefault()}
    >
      <span class="stick-knob" style={{ left: `${50 + 50 * x}%`, top: `${50 - 50 * y}%` }} aria-hidden="true" />
    </div>
  );
}
