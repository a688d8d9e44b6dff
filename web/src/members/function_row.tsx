// A function: a field for each parameter, a call button, and what came back.
// Layer: web/members.

import { useState } from "preact/hooks";
import { Failure } from "../ui/failure";
import { format_value } from "../values/format";
import { parse_input } from "../values/parse";
import { RowHead, useAction } from "./row";
import type { MemberRowProps } from "./row";
import { initial_text, ValueInput } from "./value_input";

interface Answer {
  text: string;
  took_ms: number;
}

export function FunctionRow({ object, member, live }: MemberRowProps) {
  const [texts, set_texts] = useState(() => member.parameters.map((p) => initial_text(p.type)));
  const [answer, set_answer] = useState<Answer | null>(null);
  const calling = useAction();
  const streams = [member.type, ...member.parameters.map((p) => p.type)].some((type) => type.endsWith("{generator}"));
  const call = (event: Event): void => {
    event.preventDefault();
    set_answer(null);
    calling.run(async () => {
      const args = member.parameters.map((parameter, i) => read_argument(texts[i] ?? "", parameter));
      const begun = performance.now();
      const result = await object.call(member.name, args);
      const took_ms = performance.now() - begun;
      set_answer({ text: member.type === "void" ? "done" : format_value(result), took_ms });
    });
  };
  return (
    <form onSubmit={call}>
      <RowHead member={member} signature={signature_of(member)} />
      {member.parameters.length > 0 && (
        <div class="parameters">
          {member.parameters.map((parameter, i) => (
            <ValueInput
              key={parameter.name}
              label={parameter.name}
              type={parameter.type}
              text={texts[i] ?? ""}
              disabled={!live || streams}
              on_text={(text) => set_texts(texts.map((old, at) => (at === i ? text : old)))}
            />
          ))}
        </div>
      )}
      <div class="row-line">
        <button class="button" type="submit" disabled={!live || calling.busy || streams}>
          {calling.busy ? "Calling …" : "Call"}
          <span class="unseen"> {member.name}</span>
        </button>
        {streams && <p class="note">Generators cannot be called from this page yet.</p>}
        <output class="value" hidden={answer === null}>
          {answer && (
            <>
              {answer.text} <small class="took">{answer.took_ms.toFixed(1)} ms</small>
            </>
          )}
        </output>
      </div>
      <Failure text={calling.failure} />
    </form>
  );
}

function read_argument(text: string, parameter: { name: string; type: string }): unknown {
  try {
    return parse_input(text, parameter.type);
  } catch (error) {
    throw new Error(`${parameter.name}: ${(error as Error).message}`, { cause: error });
  }
}

function signature_of(member: MemberRowProps["member"]): string {
  return `(${member.parameters.map((p) => `${p.type} ${p.name}`).join(", ")}) → ${member.type}`;
}
