// One value that is given to a member: its field, its button, and why it was refused.
// Layer: web/members.

import { useState } from "preact/hooks";
import { placeOf } from "../app/router";
import { parseInput } from "../values/parse";
import { Refusal } from "./refusal";
import { useAction } from "./row";
import type { MemberRowProps } from "./row";
import { initialText, ValueInput } from "./value_input";

export interface ValueFormProps extends MemberRowProps {
  label: string;
  /** Of the button. */
  word: string;
  give: (value: unknown) => Promise<void>;
}

export function ValueForm({ object, member: { name, type }, live, route, label, word, give }: ValueFormProps) {
  const [text, setText] = useState(initialText(type));
  const giving = useAction();
  const submit = (event: Event): void => {
    event.preventDefault();
    giving.run(async () => give(parseInput(text, type)));
  };
  return (
    <>
      <form class="row-line" onSubmit={submit}>
        <ValueInput quiet label={label} type={type} text={text} disabled={!live} onText={setText} />
        <button class="button" type="submit" disabled={!live || giving.busy}>
          {word}
          <span class="unseen"> {name}</span>
        </button>
      </form>
      <Refusal
        failure={giving.failure}
        isLocked={giving.isLocked}
        object={live ? object : null}
        place={placeOf(route)}
      />
    </>
  );
}
