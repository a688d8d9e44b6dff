// What is typed into a form, over changes of the definitions: types may be known only later, or be others after an outage.
// Layer: web/panels, pure.

import type { Definitions } from "../values/definitions";
import { makeDraft, shapeText } from "../values/draft";
import type { Draft } from "../values/draft";

export interface FormDrafts {
  /** One for each input. */
  drafts: readonly Draft[];
  /** What they were made for. */
  readonly fields: readonly { name: string; shape: string; empty: Draft }[];
  /** Names of inputs whose text was lost, since they are of another shape now. */
  readonly emptied: readonly string[];
}

/** `old` as it is in every input that has kept its name and shape; null: all empty. */
export function fitDrafts(
  old: FormDrafts | null,
  inputs: readonly { name: string; type: string }[],
  definitions: Definitions,
  scope: string,
): FormDrafts {
  const emptied = new Set(old?.emptied);
  const drafts: Draft[] = [];
  const fields = inputs.map(({ name, type }) => {
    const shape = shapeText(type, definitions, scope);
    const at = old?.fields.findIndex((field) => field.name === name) ?? -1;
    const [before, draft] = [old?.fields[at], old?.drafts[at]];
    const isKept = draft !== undefined && before?.shape === shape;
    const empty = isKept ? before.empty : makeDraft(type, definitions, scope);
    if (!isKept && draft !== before?.empty) emptied.add(name);
    drafts.push(isKept ? draft : empty);
    return { name, shape, empty };
  });
  return { drafts, fields, emptied: [...emptied] };
}
