// Along object references, from one object to another.
// Layer: web/robot.

import type { PathStep } from "../app/router";
import { explain } from "./remote";
import type { Remote } from "./remote";

/** @throws Error (rejects) where there is no such object. */
export async function walk(root: Remote, path: readonly PathStep[]): Promise<Remote> {
  let object = root;
  for (const { member, index } of path) {
    const declared = object.members.find((m) => m.name === member && m.kind === "objref");
    if (!declared) throw new Error(`${object.type} has no object "${member}"`);
    const byNumber = /(\{int32\}|\[\])$/.test(declared.type);
    object = await object.child(member, index === null ? undefined : byNumber ? Number(index) : index);
  }
  return object;
}

const FIRST_RETRY_MS = 1_000;
const LONGEST_RETRY_MS = 30_000;

/**
 * Walks, and again when the device has put another object there, or when there was none: then more and more rarely.
 * `found`  hears of the object; null with why, or "" while it is looked for again.
 * @returns a function that ends it.
 */
export function keepFound(
  root: Remote,
  path: readonly PathStep[],
  found: (object: Remote | null, failure: string) => void,
): () => void {
  let forget = (): void => undefined;
  let isEnded = false;
  const look = (retryMs: number): void => {
    walk(root, path).then(
      (object) => {
        if (isEnded) return;
        forget = object.onReleased(() => {
          found(null, "");
          look(FIRST_RETRY_MS);
        });
        found(object, "");
      },
      (error: unknown) => {
        if (isEnded) return;
        found(null, explain(error));
        const timer = setTimeout(() => look(Math.min(LONGEST_RETRY_MS, retryMs * 2)), retryMs);
        forget = () => clearTimeout(timer);
      },
    );
  };
  look(FIRST_RETRY_MS);
  return () => {
    isEnded = true;
    forget();
  };
}
