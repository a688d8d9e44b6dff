// When what is held counts as let go of although no key-up and no pointer-up has come: a stop, a page that loses the keyboard or
// the mouse, and a left button that is released while another one stays pressed. Layer: web/robot.

import { onStop } from "./control";

/** @returns a function that hears no more. */
export function onLetGo(letGo: () => void): () => void {
  const hidden = (): void => {
    if (document.hidden) letGo();
  };
  // While the browser shows its menu, or drags, the page hears of no key. Where the page has prevented that, it still does.
  const taken = (event: Event): void => {
    if (!event.defaultPrevented) letGo();
  };
  const listeners = [
    [window, "blur", letGo],
    [window, "pagehide", letGo],
    [window, "contextmenu", taken],
    [window, "dragstart", taken],
    [document, "visibilitychange", hidden],
  ] as const;
  for (const [target, name, heard] of listeners) target.addEventListener(name, heard);
  const forget = onStop(letGo);
  return () => {
    for (const [target, name, heard] of listeners) target.removeEventListener(name, heard);
    forget();
  };
}

type HeldEvent = Pick<PointerEvent, "pointerType" | "buttons" | "pointerId"> & {
  currentTarget: Pick<Element, "hasPointerCapture" | "releasePointerCapture">;
};

/**
 * For the moves of a pointer over what holds by its capture: a mouse sends its pointer-up with the last of its buttons only.
 * @returns whether the left button, which held it, is up; the capture has ended then.
 */
export function isLeftUp({ pointerType, buttons, pointerId, currentTarget }: HeldEvent): boolean {
  if (pointerType !== "mouse" || (buttons & 1) !== 0 || !currentTarget.hasPointerCapture(pointerId)) return false;
  currentTarget.releasePointerCapture(pointerId);
  return true;
}
