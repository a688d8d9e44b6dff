// Keys and buttons that drive: held is driving, let go is stopping, and anything odd is letting go.
// Layer: web/robot.

import { useCallback, useEffect, useRef, useState } from "preact/hooks";
import { isEscape } from "./control";
import { Holds } from "./holds";
import { onLetGo } from "./let_go";
import { commandFor, directionOfKey } from "./steering";
import type { Direction, DriveCommand } from "./steering";
import type { Driver } from "./driver";

export interface Driving {
  held: ReadonlySet<Direction>;
  press: (source: string, direction: Direction) => void;
  release: (source: string) => void;
  letGo: () => void;
  /** Lets go of everything and stops the robot, whoever moves it; `unsent` hears where that cannot be sent. */
  stop: () => void;
}

const NOTHING: ReadonlySet<Direction> = new Set();

/**
 * While `enabled`, follows the keyboard of the whole page; `press` and `release` are for buttons. Esc always stops, Space while the
 * controls are `shown`.
 */
export function useDriving(
  driver: Driver<DriveCommand>,
  speed: number,
  { enabled, shown, unsent }: { enabled: boolean; shown: boolean; unsent: () => void },
): Driving {
  const holds = useRef(new Holds()).current;
  const [held, setHeld] = useState(NOTHING);
  const latest = useRef({ speed, enabled, unsent });
  latest.current = { speed, enabled, unsent };

  const apply = useCallback(() => {
    const directions = holds.directions;
    setHeld(directions);
    driver.want(commandFor(directions, latest.current.speed));
  }, [driver, holds]);

  const press = useCallback(
    (source: string, direction: Direction) => {
      if (!latest.current.enabled) return;
      holds.press(source, direction);
      apply();
    },
    [apply, holds],
  );
  const release = useCallback((source: string) => (holds.release(source), apply()), [apply, holds]);
  const letGo = useCallback(() => (holds.clear(), apply()), [apply, holds]);
  const stop = useCallback(() => {
    holds.clear();
    setHeld(NOTHING);
    if (!driver.stop()) latest.current.unsent();
  }, [driver, holds]);

  useEffect(() => {
    if (!enabled) letGo();
    else apply();
  }, [enabled, speed, apply, letGo]);

  useEffect(() => {
    const escape = (event: KeyboardEvent): void => {
      if (!isEscape(event)) return;
      event.preventDefault();
      stop();
    };
    window.addEventListener("keydown", escape);
    return () => window.removeEventListener("keydown", escape);
  }, [stop]);

  useEffect(() => {
    if (!shown) return;
    const keyDown = (event: KeyboardEvent): void => {
      if (event.code === "Space" && !hasMeaning(event.target)) {
        event.preventDefault();
        return stop();
      }
      if (event.ctrlKey || event.metaKey || event.altKey) return letGo(); // a shortcut; its key-up may never come
      if (takesKeys(event.target)) return;
      const direction = directionOfKey(event.code);
      if (!direction || !latest.current.enabled) return;
      event.preventDefault(); // arrows would scroll the page
      if (!event.repeat) press(event.code, direction);
    };
    const keyUp = (event: KeyboardEvent): void => {
      if (event.key === "Meta")
        letGo(); // macOS tells no key-up of keys that were held with it
      else if (directionOfKey(event.code)) release(event.code);
    };
    const listeners = [
      [window, "keydown", keyDown],
      [window, "keyup", keyUp],
      [document, "focusin", (event: FocusEvent) => takesKeys(event.target) && letGo()],
    ] as const;
    for (const [target, name, heard] of listeners) target.addEventListener(name, heard as EventListener);
    const forget = onLetGo(letGo);
    return () => {
      for (const [target, name, heard] of listeners) target.removeEventListener(name, heard as EventListener);
      forget();
      letGo();
    };
  }, [shown, press, release, letGo, stop]);

  return { held, press, release, letGo, stop };
}

function takesKeys(target: EventTarget | null): boolean {
  return target instanceof Element && target.closest("input, textarea, select, [contenteditable]") !== null;
}

/** Whether Space there presses, opens, writes or scrolls something. */
function hasMeaning(target: EventTarget | null): boolean {
  const own = 'button, a, summary, input:not([type="range"]), textarea, select, [contenteditable], [tabindex="0"]';
  return target instanceof Element && (target.closest(own) !== null || isScrollArea(target));
}

/** Browsers give the keyboard to scroll areas that have no tabindex, too. */
function isScrollArea(target: Element): boolean {
  const { scrollHeight, clientHeight } = target;
  const scrolls = scrollHeight > clientHeight && /auto|scroll/.test(getComputedStyle(target).overflowY);
  return scrolls && !target.contains(document.body); // which scrolls where nothing has the keyboard
}
