// A generator function: run it, step by step or by itself, and stop it.
// Layer: web/panels.

import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import { t } from "../app/language";
import { useStore } from "../app/store";
import { Refusal } from "../members/refusal";
import { onStop } from "../robot/control";
import type { Member } from "../robot/remote";
import { clockTimeMs } from "../ui/words";
import { rowsOf } from "../values/rows";
import { DraftInput } from "./draft_input";
import { GeneratorRun } from "./generator_run";
import { membersFor, textIn } from "./panel";
import type { PanelProps } from "./panel";
import { MemberSelect } from "./parts";
import { useDrafts } from "./use_drafts";

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
  const inputs = useMemo(() => member.parameters.map(inputOf), [member]);
  const { fields, lost } = useDrafts(inputs, definitions, scope);
  const [results, setResults] = useState<readonly Result[]>([]);
  const latest = useRef({ type: member.type, definitions, scope });
  latest.current = { type: member.type, definitions, scope };
  const run = useMemo(
    () =>
      new GeneratorRun((value) => {
        const { type, definitions, scope } = latest.current;
        const text = rowsOf(value, type.replace(GENERATOR, ""), definitions, scope)
          .map((row) => (row.name === "" ? row.text : `${row.name}: ${row.text}`))
          .join(", ");
        setResults((old) => [{ number: (old[0]?.number ?? 0) + 1, time: Date.now(), text }, ...old.slice(0, MOST - 1)]);
      }),
    [], // also over a connection that is made anew: it says what became of the run before
  );
  const state = useStore(run.state);
  const failure = useStore(run.failure);
  useEffect(() => () => run.leave(), [object, run]);
  useEffect(() => onStop(() => void run.stop()), [run]);

  const begin = (): AsyncGenerator<unknown, void, unknown> => {
    if (!object) throw new Error(t("not connected"));
    const args = fields.filter(({ isStep }) => !isStep);
    return object.generate(
      member.name,
      args.map(({ value }) => value()),
    );
  };
  const given = useRef((): unknown => undefined);
  given.current = () => fields.find(({ isStep }) => isStep)?.value(); // what is typed in while it runs counts
  const go = (byItself: boolean): void => {
    if (run.isFresh) setResults([]);
    void run.go(byItself, begin, () => given.current());
  };
  const isUnderWay = state === "running" || state === "stepping" || state === "stopping";
  const canStop = state === "running" || state === "stepping" || state === "held";
  return (
    <div class="member-form">
      {fields.map(({ name, type, isStep, draft, change }) => (
        <DraftInput
          key={name}
          label={isStep ? `${name}, ${t("each step")}` : name}
          {...{ type, definitions, scope, draft, change }}
        />
      ))}
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
      <Refusal failure={failure ?? lost} isLocked={run.isLocked} object={object} place={place} />
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

const GENERATOR = /\{generator\}$/;

/** `isStep`: it is given with each step, not when the run begins. */
function inputOf({ name, type }: Member["parameters"][number]): { name: string; type: string; isStep: boolean } {
  return { name, type: type.replace(GENERATOR, ""), isStep: GENERATOR.test(type) };
}
