// Along object references, from one object to another.
// Layer: web/robot.

import type { PathStep } from "../app/router";
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
