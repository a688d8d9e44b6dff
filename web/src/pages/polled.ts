// A part of a page that shows a list of the gateway's: asked for while it is shown. Layer: web/pages.

import { useEffect, useState } from "preact/hooks";
import { t } from "../app/language";
import { useStore } from "../app/store";
import type { Polled, PolledList } from "../gateway/polled_list";
import { clockTime, ended } from "../ui/words";

export function usePolled<T>(make: () => PolledList<T>): Polled<T> {
  const [list] = useState(make);
  useEffect(() => {
    list.start();
    return () => list.stop();
  }, [list]);
  return useStore(list.state);
}

/** What is to be said before the list. Changes rarely, so that it can be announced. `known` says it of what there is. */
export function headline<T>(state: Polled<T>, known: (items: T[]) => string): string {
  if (state.kind === "loading") return t("Asking the gateway for them.");
  if (state.kind === "denied") return t("You may not see them: {0}", ended(state.reason));
  if (state.kind === "known") return known(state.items);
  const below = state.items && state.items.length > 0 ? ` ${t("Below is what it said last.")}` : "";
  const since = clockTime(state.since);
  return `${t("The gateway has not told them since {0}: {1}", since, ended(state.reason))}${below}`;
}
