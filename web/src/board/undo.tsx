// What was taken off a board by one press is put back by another, until the board is changed again.
// Layer: web/board.

import { useEffect, useRef, useState } from "preact/hooks";
import { t } from "../app/language";
import type { Board } from "./board";

interface Lost {
  /** What was done, for people. */
  words: string;
  before: Board;
}

export interface Undo {
  lost: Lost | null;
  lose: (words: string, before: Board) => void;
  forget: () => void;
}

/** `place`: of the board; what another one has lost is not put back here. */
export function useUndo(place: string): Undo {
  const [lost, setLost] = useState<(Lost & { place: string }) | null>(null);
  return {
    lost: lost?.place === place ? lost : null,
    lose: (words, before) => setLost({ words, before, place }),
    forget: () => setLost(null),
  };
}

/** Always there: a region that comes with its text is not read out by all screen readers. */
export function UndoBar({ lost, undo }: { lost: Lost | null; undo: (before: Board) => void }) {
  const button = useRef<HTMLButtonElement>(null);
  // The button that was pressed may be gone with its panel: the keyboard goes on here.
  useEffect(() => button.current?.focus({ preventScroll: true }), [lost]);
  return (
    <div class={lost ? "undo-bar" : "unseen"}>
      <p role="status">{lost?.words}</p>
      {lost && (
        <button ref={button} class="button" type="button" onClick={() => undo(lost.before)}>
          {t("Undo")}
        </button>
      )}
    </div>
  );
}
