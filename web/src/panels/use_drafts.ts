// What is typed in for some inputs, over outages: each text stays with the name of its input, as long as that keeps its type.
// Layer: web/panels.

import { useMemo, useState } from "preact/hooks";
import { t } from "../app/language";
import type { Definitions } from "../values/definitions";
import { makeDraft, valueOf } from "../values/draft";
import type { Draft } from "../values/draft";
import { fitDrafts } from "./form_drafts";
import type { FormDrafts } from "./form_drafts";

interface Input {
  name: string;
  type: string;
}

export interface Typed {
  draft: Draft;
  change: (draft: Draft) => void;
  /** @throws Error with the input's name and what is wrong in its text. */
  value: () => unknown;
}

/**
 * `inputs`  the same array as long as they are the same.
 * @returns one field for each of them. `lost`: which texts were lost, in words; null: none. `form`: what is in the fields now, which
 *   `fill` puts into them again, also over a change of the types.
 */
export function useDrafts<I extends Input>(
  inputs: readonly I[],
  definitions: Definitions,
  scope: string,
): { fields: (I & Typed)[]; lost: string | null; form: FormDrafts; fill: (form: FormDrafts) => void } {
  const [typed, setTyped] = useState<FormDrafts | null>(null);
  const form = useMemo(() => fitDrafts(typed, inputs, definitions, scope), [typed, inputs, definitions, scope]);
  const fields = inputs.map((input, i) => {
    const draft = form.drafts[i] ?? makeDraft(input.type, definitions, scope);
    const change = (next: Draft): void =>
      setTyped({ ...form, drafts: form.drafts.map((old, at) => (at === i ? next : old)), emptied: [] });
    const value = (): unknown => {
      try {
        return valueOf(draft, input.type, definitions, scope);
      } catch (error) {
        throw new Error(`${input.name}: ${(error as Error).message}`, { cause: error });
      }
    };
    return { ...input, draft, change, value };
  });
  const { emptied } = form;
  return {
    fields,
    lost: emptied.length > 0 ? t("Emptied, since its type has changed: {0}", emptied.join(", ")) : null,
    form,
    fill: setTyped,
  };
}
