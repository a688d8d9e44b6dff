// Connections to services other than the page's own: one for each, however many panels show it.
// Layer: web/live.

import { useEffect, useMemo, useState } from "preact/hooks";
import { Store, useStore } from "../app/store";
import type { DeviceList } from "../gateway/devices";
import { linkTo } from "../gateway/link_to";
import type { Link } from "../robot/link";
import { openIn } from "../robot/link";
import type { LinkState } from "../robot/link";
import type { Remote } from "../robot/remote";
import { parseStep, splitSteps } from "../app/router";
import type { PathStep } from "../app/router";
import { keepFound } from "../robot/walk";
import { Shared } from "./shared";

const links = new Shared<string, Link>();
const nowhere = new Store<LinkState>({ kind: "connecting" });

function openLink(place: string, list: DeviceList): { value: Link; close: () => void } {
  const [device = "", service = ""] = place.split("/").map(decodeURIComponent);
  return links.open(place, () => {
    const { link, dispose } = linkTo(device, service, list);
    return { value: link, end: dispose };
  });
}

export interface ObjectState {
  /** For commands and values; null while there is no connection, or the device is away. */
  object: Remote | null;
  /** For a stop: also while the device is only said to be away. */
  reach: Remote | null;
  /** For what was known of it. */
  last: Remote | null;
  failure: string | null;
}

/** The object at `path` ("Webcams[0].lens") of the page's service, or of another one ("device/service"). */
export function useObject(own: Link, from: string, path: string, list: DeviceList): ObjectState {
  const [other, setOther] = useState<{ from: string; link: Link } | null>(null);
  useEffect(() => {
    if (from === "") return setOther(null);
    const { value: link, close } = openLink(from, list);
    setOther({ from, link });
    return close;
  }, [from, list]);
  const state = useStore(from === "" ? own.state : other?.from === from ? other.link.state : nowhere);
  const steps = useMemo(() => (path === "" ? [] : splitSteps(path).map(parseStep)), [path]);
  const found = useWalk(state, steps, from);
  return { ...found, failure: found.failure ?? (from !== "" && state.kind === "lost" ? state.reason : null) };
}

/** The object at the end of `path`, found anew on every connection. `from`: which service it is of, where that may change. */
export function useWalk(state: LinkState, path: readonly PathStep[], from = ""): ObjectState {
  const root = openIn(state);
  const key = JSON.stringify([from, path]);
  const [found, setFound] = useState<{ object: Remote; root: Remote | null; key: string } | null>(null);
  const [failure, setFailure] = useState<string | null>(null);
  useEffect(() => {
    if (!root) return;
    setFailure(null);
    return keepFound(root, path, (object, why) => {
      setFound((old) => (object ? { object, root, key } : old && { ...old, root: null }));
      setFailure(why === "" ? null : why);
    });
  }, [root, key]);
  const isOfPath = found?.key === key;
  // The root needs no way to it: a stop is ready at once.
  const reach = path.length === 0 ? root : isOfPath && found.root === root ? found.object : null;
  return {
    object: state.kind === "online" ? reach : null,
    reach,
    last: reach ?? (isOfPath ? found.object : null),
    failure,
  };
}
