// Moving and sizing a panel: by pointer, cell by cell, and by the arrow keys.
// Layer: web/board.

import { useRef } from "preact/hooks";
import type { Placed, Place } from "./layout";

export type Change = (place: Partial<Place>) => void;

const STEPS: Readonly<Record<string, readonly [number, number]>> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
};

export function handleKey(
  event: KeyboardEvent,
  panel: Place,
  move: Change,
  step: (dx: number, dy: number) => void,
): void {
  const [dx, dy] = STEPS[event.key] ?? [0, 0];
  if (dx === 0 && dy === 0) return;
  event.preventDefault();
  if (event.shiftKey) move({ w: panel.w + dx, h: panel.h + dy });
  else step(dx, dy);
}

interface Grip {
  onPointerDown: (event: PointerEvent) => void;
  onPointerMove: (event: PointerEvent) => void;
  onLostPointerCapture: () => void;
}

interface Held {
  x: number;
  y: number;
  from: Place;
  cell: { width: number; height: number };
}

export function useDrag(panel: Placed, move: Change): { move: Grip; size: Grip } {
  const held = useRef<Held | null>(null);
  const grip = (change: (from: Place, dx: number, dy: number) => Partial<Place>): Grip => ({
    onPointerDown: (event) => {
      const board = (event.currentTarget as Element).closest(".board");
      if (event.button !== 0 || !board) return;
      event.preventDefault();
      (event.currentTarget as HTMLElement).focus();
      (event.currentTarget as Element).setPointerCapture(event.pointerId);
      held.current = { x: event.clientX, y: event.clientY, from: panel, cell: cellOf(board) };
    },
    onPointerMove: (event) => {
      const { current } = held;
      if (!current) return;
      const dx = Math.round((event.clientX - current.x) / current.cell.width);
      const dy = Math.round((event.clientY - current.y) / current.cell.height);
      move(change(current.from, dx, dy));
    },
    onLostPointerCapture: () => void (held.current = null),
  });
  return {
    move: grip((from, dx, dy) => ({ x: Math.max(0, from.x + dx), y: Math.max(0, from.y + dy) })),
    size: grip((from, dx, dy) => ({ w: from.w + dx, h: from.h + dy })),
  };
}

/** A cell with its gap, in pixels. */
function cellOf(board: Element): { width: number; height: number } {
  const style = getComputedStyle(board);
  const columns = style.gridTemplateColumns.split(" ");
  const gap = Number.parseFloat(style.columnGap) || 0;
  return {
    width: (Number.parseFloat(columns[0] ?? "") || 80) + gap,
    height: (Number.parseFloat(style.gridAutoRows) || 36) + gap,
  };
}
