// The part of a long list that is near what the window shows, so that thousands of items are as quick as a few.
// Layer: web/ui. Items have the heights that they were measured with; one that was never shown is taken for `guess` high.

import { useEffect, useLayoutEffect, useMemo, useRef, useState } from "preact/hooks";

export interface Part {
  /** Of the items to show: the first, and that behind the last. */
  from: number;
  to: number;
  /** Pixels of those before and behind. */
  before: number;
  behind: number;
}

/** `top`, `bottom`: what is seen, in pixels from the top of the list. */
export function partOf(heights: readonly number[], top: number, bottom: number): Part {
  let from = 0;
  let before = 0;
  while (from < heights.length && before + (heights[from] ?? 0) <= top) before += heights[from++] ?? 0;
  let to = from;
  let end = before;
  while (to < heights.length && end < bottom) end += heights[to++] ?? 0;
  let behind = 0;
  for (let at = to; at < heights.length; at++) behind += heights[at] ?? 0;
  return { from, to, before, behind };
}

const MARGIN_PX = 800; // what is scrolled to is there already, and so is what the Tab key goes to next

export interface WindowedList {
  part: Part;
  /** Of the list. Its items tell their key by `data-key`. */
  list: { current: HTMLUListElement | null };
}

export function useWindowedList(keys: readonly string[], guess: number): WindowedList {
  const list = useRef<HTMLUListElement | null>(null);
  const measured = useRef(new Map<string, number>()).current;
  const [, redraw] = useState(0);
  const [seen, setSeen] = useState({ top: 0, bottom: window.innerHeight });
  useEffect(() => {
    let frame = 0;
    const look = (): void => {
      frame = 0;
      const top = -(list.current?.getBoundingClientRect().top ?? 0);
      setSeen((before) =>
        Math.abs(before.top - top) < MARGIN_PX / 4 ? before : { top, bottom: top + window.innerHeight },
      );
    };
    const heard = (): void => void (frame ||= requestAnimationFrame(look));
    look();
    window.addEventListener("scroll", heard, { passive: true });
    window.addEventListener("resize", heard);
    return () => {
      cancelAnimationFrame(frame);
      window.removeEventListener("scroll", heard);
      window.removeEventListener("resize", heard);
    };
  }, []);
  const sizes = useMemo(
    () =>
      new ResizeObserver((entries) => {
        let hasChanged = false;
        for (const { target } of entries) {
          const { offsetHeight, dataset } = target as HTMLElement;
          if (offsetHeight === 0 || measured.get(dataset["key"] ?? "") === offsetHeight) continue;
          measured.set(dataset["key"] ?? "", offsetHeight);
          hasChanged = true;
        }
        if (hasChanged) redraw((count) => count + 1);
      }),
    [],
  );
  const heights = keys.map((key) => measured.get(key) ?? guess);
  const part = partOf(heights, seen.top - MARGIN_PX, seen.bottom + MARGIN_PX);
  const shown = keys.slice(part.from, part.to).join("\n");
  useLayoutEffect(() => {
    for (const item of list.current?.children ?? []) if ((item as HTMLElement).dataset["key"]) sizes.observe(item);
    return () => sizes.disconnect();
  }, [shown, sizes]);
  return { part, list };
}
