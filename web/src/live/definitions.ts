// What is known of the types of an object, for all panels that show it.
// Layer: web/live.

import { useEffect, useState } from "preact/hooks";
import type { Remote } from "../robot/remote";
import { Definitions } from "../values/definitions";

const READ_MS = 2_000;
const NONE = new Definitions([]);
const known = new WeakMap<Remote, { definitions: Definitions; count: number; readAt: number }>();

/** More may become known while values come. Each look copies all texts, so it is taken every two seconds, once for all who ask. */
export function definitionsOf(object: Remote, now = performance.now()): Definitions {
  const before = known.get(object);
  if (before && now - before.readAt < READ_MS) return before.definitions;
  const texts = object.definitions;
  const definitions = before?.count === texts.length ? before.definitions : new Definitions(texts);
  known.set(object, { definitions, count: texts.length, readAt: now });
  return definitions;
}

export function useDefinitions(object: Remote | null): Definitions {
  const [, setSeen] = useState(NONE);
  useEffect(() => {
    if (!object) return;
    const timer = setInterval(() => setSeen(definitionsOf(object)), READ_MS);
    return () => clearInterval(timer);
  }, [object]);
  return object ? definitionsOf(object) : NONE;
}
