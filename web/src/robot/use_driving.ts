// Keys and buttons that drive: held is driving, let go is stopping, and anything odd is letting go.
// Layer: web/robot.

import { useCallback, useEffect, useRef, useState } from "preact/hooks";
import { Holds } from "./holds";
import { command_for, direction_of_key } from "./steering";
import type { Direction } from "./steering";
import type { Driver } from "./driver";

export interface Driving {
  held: ReadonlySet<Direction>;
  press: (source: string, direction: Direction) => void;
  release: (source: string) => void;
  /** Lets go of everything and stops the robot, whoever moves it. */
  stop: () => void;
}

const NOTHING: ReadonlySet<Direction> = new Set();

/** While `enabled`, follows the keyboard of the whole page; `press` and `release` are for buttons. */
export function useDriving(driver: Driver, speed: number, enabled: boolean): Driving {
  const holds = useRef(new Holds()).current;
  const [held, set_held] = useState(NOTHING);
  const latest = useRef({ speed, enabled });
  latest.current = { speed, enabled };

  const apply = useCallback(() => {
    const directions = holds.directions;
    set_held(directions);
    driver.want(command_for(directions, latest.current.speed));
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
  const let_go = useCallback(() => (holds.clear(), apply()), [apply, holds]);
  const stop = useCallback(() => {
    holds.clear();
    set_held(NOTHING);
    driver.stop();
  }, [driver, holds]);

  useEffect(() => {
    if (!enabled) let_go();
    else apply();
  }, [enabled, speed, apply, let_go]);

  useEffect(() => {
    const key_down = (event: KeyboardEvent): void => {
      if (event.ctrlKey || event.metaKey || event.altKey) return let_go(); // a shortcut; its key-up may never come
      if (takes_keys(event.target)) return;
      const direction = direction_of_key(event.code);
      if (direction) {
        event.preventDefault(); // arrows would scroll the page
        if (!event.repeat) press(event.code, direction);
      } else if (event.code === "Escape" || (event.code === "Space" && !is_button(event.target))) {
        event.preventDefault();
        stop();
      }
    };
    const key_up = (event: KeyboardEvent): void => {
      if (event.key === "Meta") let_go(); // macOS tells no key-up of keys that were held with it
      else if (direction_of_key(event.code)) release(event.code);
    };
    const hidden = (): void => {
      if (document.hidden) let_go();
    };
    const listeners = [
      [window, "keydown", key_down],
      [window, "keyup", key_up],
      [window, "blur", let_go],
      [window, "pagehide", let_go],
      [document, "visibilitychange", hidden],
      [document, "focusin", (event: FocusEvent) => takes_keys(event.target) && let_go()],
    ] as const;
    for (const [target, name, heard] of listeners) target.addEventListener(name, heard as EventListener);
    return () => {
      for (const [target, name, heard] of listeners) target.removeEventListener(name, heard as EventListener);
      let_go();
    };
  }, [press, release, let_go, stop]);

  return { held, press, release, stop };
}

function takes_keys(target: EventTarget | null): boolean {
  return target instanceof Element && target.closest("input, textarea, select, [contenteditable]") !== null;
}

function is_button(target: EventTarget | null): boolean {
  return target instanceof Element && target.closest("button, a") !== null;
}
