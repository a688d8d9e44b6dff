// A generator function: run it, step by step or by itself, and stop it.
// Layer: web/panels.

import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import { t } from "../app/language";
import { useStore } from "../app/store";
import { Refusal } from "../members/refusal";
import { onStop } from "../robot/control";
import type { Member } from "../robot/remote";
import { clockTimeMs } from "../ui/words";
import { makeDraft, valueOf } from "../values/draft";
import type { Draft } from "../values/draft";
import { rowsOf } from "../values/rows";
import { DraftInput } from "./draft_input";
import { GeneratorRun } from "./generator_run";
import { membersFor, textIn } from "./panel";
import type { PanelProps } from "./panel";
import { MemberSelect } from "./parts";

interface Result {
  number: number;
  time: number;
  text: string;
}

const MOST = 200;

export default function GeneratorPanel(props: PanelProps) {
  const { members, settings, change } = props;
  const choices = membersFor("generator", members);
  const name = textIn(settings, "member") || choices[0]?.name || "";
  const member = choices.find((each) => each.name === name);
  return (
    <div class="generator-panel panel-scroll">
      <div class="panel-tools">
        <MemberSelect members={choices} chosen={name} choose={(next) => change({ member: next })} />
      </div>
      {member ? (
        <Run key={name} {...props} member={member} />
      ) : (
        <p class="note">{t("This object has no generators.")}</p>
      )}
    </div>
  );
}

function Run({ object, definitions, scope, place, member }: PanelProps & { member: Member }) {
  const plain = member.parameters.filter(({ type }) => !type.endsWith("{generator}"));
  const stepped = member.parameters.find(({ type }) => type.endsWith("{generator}"));
  const stepType = stepped?.type.replace(/\{generator\}$/, "") ?? "";
  const [drafts, setDrafts] = useState(() => plain.map(({ type }) => makeDraft(type, definitions, scope)));
  const [step, setStep] = useState(() => (stepped ? makeDraft(stepType, definitions, scope) : null));
  const [results, setResults] = useState<readonly Result[]>([]);
  const latest = useRef({ definitions, scope });
  latest.current = { definitions, scope };
  const run = useMemo(
    () =>
      new GeneratorRun((value) => {
        const text = rowsOf(
          value,
          member.type.replace(/\{generator\}$/, ""),
          latest.current.definitions,
          latest.current.scope,
        )
          .map((row) => (row.name === "" ? row.text : `${row.name}: ${row.text}`))
          .join(", ");
        setResults((old) => [{ number: (old[0]?.number ?? 0) + 1, time: Date.now(), text }, ...old.slice(0, MOST - 1)]);
      }),
    [member],
  );
  const state = useStore(run.state);
  const failure = useStore(run.failure);
  useEffect(() => () => run.leave(), [object, run]);
  useEffect(() => onStop(() => void run.stop()), [run]);

  const read = (draft: Draft | undefined, type: string): unknown =>
    valueOf(draft ?? makeDraft(type, definitions, scope), type, definitions, scope);
  const begin = (): AsyncGenerator<unknown, void, unknown> => {
    if (!object) throw new Error(t("not connected"));
    return object.generate(
      member.name,
      plain.map(({ type }, i) => read(drafts[i], type)),
    );
  };
  const given = useRef((): unknown => undefined);
  given.current = () => (step === null ? undefined : read(step, stepType)); // what is typed in while it runs counts
  const go = (byItself: boolean): void => {
    if (run.isFresh) setResults([]);
    void run.go(byItself, begin, () => given.current());
  };
  const isUnderWay = state === "running" || state === "stepping" || state === "stopping";
  const canStop = state === "running" || state === "stepping" || state === "held";
  return (
    <div class="member-form">
      {plain.map(({ name, type }, i) => (
        <DraftInput
          key={name}
          label={name}
          type={type}
          definitions={definitions}
          scope={scope}
          draft={drafts[i] ?? makeDraft(type, definitions, scope)}
          change={(next) => setDrafts(drafts.map((old, at) => (at === i ? next : old)))}
        />
      ))}
      {stepped && step && (
        <DraftInput
          label={`${stepped.name}, ${t("each step")}`}
          type={stepType}
          definitions={definitions}
          scope={scope}
          draft={step}
          change={setStep}
        />
      )}
      <div class="row-line">
        <button class="button" type="button" disabled={!object || isUnderWay} onClick={() => go(true)}>
          {t("Run")}
        </button>
        <button class="button" type="button" disabled={!object || isUnderWay} onClick={() => go(false)}>
          {t("Step")}
        </button>
        <button class="button" type="button" disabled={!canStop} onClick={() => void run.stop()}>
          {t("Stop")}
        </button>
        <span class="note" role="status" data-run={state}>
          {state === "stopping" ? t("stopping: the device answers the step under way first") : t(state)}
        </span>
      </div>
      <Refusal failure={failure} isLocked={run.isLocked} object={object} place={place} />
      <ol class="log" tabIndex={0} aria-label={t("Results of {0}", member.name)}>
        {results.map(({ number, time, text }) => (
          <li key={number}>
            <span class="log-number">{number}</span>
            <time class="log-time">{clockTimeMs(time)}</time>
            <span>{text}</span>
          </li>
        ))}
      </ol>
    </div>
  );
}
