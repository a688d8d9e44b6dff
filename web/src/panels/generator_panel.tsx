// A generator function: run it, step by step or by itself, and stop it.
// Layer: web/panels.

import { useEffect, useRef, useState } from "preact/hooks";
import { t } from "../app/language";
import { explain } from "../robot/remote";
import type { Member } from "../robot/remote";
import { Failure } from "../ui/failure";
import { clockTimeMs } from "../ui/words";
import { makeDraft, valueOf } from "../values/draft";
import { rowsOf } from "../values/rows";
import { DraftInput } from "./draft_input";
import { membersFor, textIn } from "./panel";
import type { PanelProps } from "./panel";
import { MemberSelect } from "./parts";

type State = "ready" | "stepping" | "running" | "held" | "ended" | "stopped";
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

function Run({ object, definitions, scope, member }: PanelProps & { member: Member }) {
  const plain = member.parameters.filter(({ type }) => !type.endsWith("{generator}"));
  const stepped = member.parameters.find(({ type }) => type.endsWith("{generator}"));
  const stepType = stepped?.type.replace(/\{generator\}$/, "") ?? "";
  const [drafts, setDrafts] = useState(() => plain.map(({ type }) => makeDraft(type, definitions, scope)));
  const [step, setStep] = useState(() => (stepped ? makeDraft(stepType, definitions, scope) : null));
  const [state, setState] = useState<State>("ready");
  const [results, setResults] = useState<readonly Result[]>([]);
  const [failure, setFailure] = useState<string | null>(null);
  const run = useRef<AsyncGenerator<unknown, void, unknown> | null>(null);
  const goesOn = useRef(false);

  const end = (next: State): void => {
    goesOn.current = false;
    const running = run.current;
    run.current = null;
    setState(next);
    running?.return().catch(() => undefined); // it is over, whatever the device says to that
  };
  useEffect(() => () => end("stopped"), [object]);

  const advance = async (): Promise<void> => {
    if (!object) throw new Error(t("not connected"));
    run.current ??= object.generate(
      member.name,
      plain.map(({ type }, i) => valueOf(drafts[i] ?? makeDraft(type, definitions, scope), type, definitions, scope)),
    );
    const given = step === null ? undefined : valueOf(step, stepType, definitions, scope);
    const mine = run.current;
    const next = await mine.next(given);
    if (run.current !== mine) return;
    if (next.done) return end("ended");
    const text = rowsOf(next.value, member.type.replace(/\{generator\}$/, ""), definitions, scope)
      .map((row) => (row.name === "" ? row.text : `${row.name}: ${row.text}`))
      .join(", ");
    setResults((old) => [{ number: (old[0]?.number ?? 0) + 1, time: Date.now(), text }, ...old.slice(0, MOST - 1)]);
  };
  const go = async (byItself: boolean): Promise<void> => {
    setFailure(null);
    if (run.current === null) setResults([]);
    goesOn.current = byItself;
    setState(byItself ? "running" : "stepping");
    try {
      do await advance();
      while (goesOn.current);
      if (run.current !== null) setState("held");
    } catch (error) {
      if (run.current === null && goesOn.current) return; // stopped meanwhile
      end("ended");
      setFailure(explain(error));
    }
  };
  const isUnderWay = state === "running" || state === "stepping";
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
        <button class="button" type="button" disabled={!object || isUnderWay} onClick={() => void go(true)}>
          {t("Run")}
        </button>
        <button class="button" type="button" disabled={!object || isUnderWay} onClick={() => void go(false)}>
          {t("Step")}
        </button>
        <button
          class="button"
          type="button"
          disabled={state === "ready" || state === "ended" || state === "stopped"}
          onClick={() => end("stopped")}
        >
          {t("Stop")}
        </button>
        <span class="note" role="status">
          {t(state)}
        </span>
      </div>
      <Failure text={failure} />
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
