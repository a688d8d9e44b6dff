// A function: a field for each parameter, a call button, and what came back.
// Layer: web/members.

import { useState } from "preact/hooks";
import { t } from "../app/language";
import { placeOf } from "../app/router";
import { formatValue } from "../values/format";
import { parseInput } from "../values/parse";
import { Refusal } from "./refusal";
import { PATIENT, RowHead, useAction } from "./row";
import type { MemberRowProps } from "./row";
import { initialText, ValueInput } from "./value_input";

interface Answer {
  text: string;
  tookMs: number;
}

export function FunctionRow({ object, member, live, route }: MemberRowProps) {
  const [texts, setTexts] = useState(() => member.parameters.map((p) => initialText(p.type)));
  const [answer, setAnswer] = useState<Answer | null>(null);
  const calling = useAction();
  const streams = [member.type, ...member.parameters.map((p) => p.type)].some((type) => type.endsWith("{generator}"));
  const call = (event: Event): void => {
    event.preventDefault();
    setAnswer(null);
    calling.run(async () => {
      const args = member.parameters.map((parameter, i) => readArgument(texts[i] ?? "", parameter));
      const begun = performance.now();
      const result = await object.call(member.name, args, PATIENT);
      const tookMs = performance.now() - begun;
      setAnswer({ text: member.type === "void" ? t("done") : formatValue(result), tookMs });
    });
  };
  return (
    <form onSubmit={call}>
      <RowHead member={member} signature={signatureOf(member)} />
      {member.parameters.length > 0 && (
        <div class="parameters">
          {member.parameters.map((parameter, i) => (
            <ValueInput
              key={parameter.name}
              label={parameter.name}
              type={parameter.type}
              text={texts[i] ?? ""}
              disabled={!live || streams}
              onText={(text) => setTexts(texts.map((old, at) => (at === i ? text : old)))}
            />
          ))}
        </div>
      )}
      <div class="row-line">
        <button class="button" type="submit" disabled={!live || calling.busy || streams}>
          {calling.busy ? t("Calling …") : t("Call")}
          <span class="unseen"> {member.name}</span>
        </button>
        {streams && <p class="note">{t("The Generator panel of the board runs it.")}</p>}
        <output class="value" hidden={answer === null}>
          {answer && (
            <>
              {answer.text} <small class="took">{answer.tookMs.toFixed(1)} ms</small>
            </>
          )}
        </output>
      </div>
      <Refusal
        failure={calling.failure}
        isLocked={calling.isLocked}
        object={live ? object : null}
        place={placeOf(route)}
      />
    </form>
  );
}

function readArgument(text: string, parameter: { name: string; type: string }): unknown {
  try {
    return parseInput(text, parameter.type);
  } catch (error) {
    throw new Error(`${parameter.name}: ${(error as Error).message}`, { cause: error });
  }
}

function signatureOf(member: MemberRowProps["member"]): string {
  return `(${member.parameters.map((p) => `${p.type} ${p.name}`).join(", ")}) → ${member.type}`;
}
