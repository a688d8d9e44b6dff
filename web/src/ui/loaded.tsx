// A part of the page whose code is loaded once it is looked at.
// Layer: web/ui.

import type { ComponentType } from "preact";
import { useEffect, useState } from "preact/hooks";
import { t } from "../app/language";
import { Store, useStore } from "../app/store";
import { untilDone } from "../live/pause";
import { Failure } from "./failure";

export type Loaded<Props> = ComponentType<Props> & {
  /** Whether the code is there; then for good. */
  isThere: Store<boolean>;
};

/** While it is shown and its code cannot be had, as while the gateway starts anew, the code is asked for again and again. */
export function loaded<Props>(load: () => Promise<{ default: ComponentType<Props> }>): Loaded<Props> {
  let Shown: ComponentType<Props> | null = null;
  const isThere = new Store(false);
  const get = async (): Promise<void> => {
    if (isThere.value) return;
    Shown = (await load()).default;
    isThere.value = true;
  };
  const Part: ComponentType<Props> = (props) => {
    useStore(isThere);
    const [hasFailed, setFailed] = useState(false);
    useEffect(() => {
      const gone = new AbortController();
      void untilDone(get, () => setFailed(true), gone.signal);
      return () => gone.abort();
    }, []);
    if (Shown) return <Shown {...props} />;
    return hasFailed && <Missing />;
  };
  return Object.assign(Part, { isThere });
}

/** A gateway of another version has it by another name, which only the page loaded again knows. */
function Missing() {
  return (
    <>
      <Failure text={t("The gateway has not sent this part of the page yet. It is asked again.")} />
      <button class="button" type="button" onClick={() => location.reload()}>
        {t("Load the page again")}
      </button>
    </>
  );
}
