// Calls, properties to set, values to send: fields from the types, what came back, what was done before, and the same as code.
// Layer: web/panels.

import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import { t } from "../app/language";
import { Refusal } from "../members/refusal";
import { PATIENT, useAction } from "../members/row";
import type { Member } from "../robot/remote";
import { loaded } from "../ui/loaded";
import { clockTime, flowing } from "../ui/words";
import { draftOf, jsonOf } from "../values/draft";
import { rowsOf } from "../values/rows";
import type { CodeProps } from "./code_part";
import { DraftInput } from "./draft_input";
import type { FormDrafts } from "./form_drafts";
import { inputsOf, membersFor, textIn, textsIn } from "./panel";
import type { PanelProps } from "./panel";
import { MemberSelect } from "./parts";
import { useDrafts } from "./use_drafts";
import "./form_panel.css";

const LoadedCode = loaded<CodeProps>(() => import("./code_part"));

/** One member by choice, or a row of them where the settings name several. */
export default function FormPanel(props: PanelProps) {
  const { members, settings, change } = props;
  const choices = membersFor("form", members);
  const several = textsIn(settings, "members");
  if (several.length > 0) {
    const shown = several
      .map((name) => choices.find((each) => each.name === name))
      .filter((each) => each !== undefined);
    return (
      <div class="form-panel is-several panel-scroll">
        {shown.map((member) => (
          <MemberForm key={member.name} {...props} member={member} />
        ))}
      </div>
    );
  }
  const name = textIn(settings, "member") || choices[0]?.name || "";
  const member = choices.find((each) => each.name === name);
  return (
    <div class="form-panel panel-scroll">
      <div class="panel-tools">
        <MemberSelect members={choices} chosen={name} choose={(next) => change({ ...settings, member: next })} />
      </div>
      {member && <MemberForm key={`${member.kind} ${member.name}`} {...props} member={member} withMore />}
    </div>
  );
}

interface Done {
  time: number;
  form: FormDrafts;
  words: string;
  rows: { name: string; text: string }[];
  tookMs: number;
}

const MOST_DONE = 20;

interface MemberFormProps extends PanelProps {
  member: Member;
  /** History and code, too. */
  withMore?: boolean;
}

function MemberForm({ object, member, definitions, scope, place, withMore = false }: MemberFormProps) {
  const inputs = useMemo(() => inputsOf(member), [member]);
  const { fields, lost, form, fill } = useDrafts(inputs, definitions, scope);
  const isTouched = useRef(false); // by a person: it stays as it is, whatever the device has
  const touch = (fillIn: () => void): void => {
    isTouched.current = true;
    fillIn();
  };
  const showRead = (value: unknown): void => {
    isTouched.current = false;
    fill({ ...form, drafts: [draftOf(value, member.type, definitions, scope)], emptied: [] });
  };
  const [done, setDone] = useState<readonly Done[]>([]);
  const doing = useAction();
  const values = (): unknown[] => fields.map(({ value }) => value());
  const submit = (event: Event): void => {
    event.preventDefault();
    doing.run(async () => {
      if (!object) throw new Error(t("not connected"));
      const given = values();
      const begun = performance.now();
      const result =
        member.kind === "function"
          ? await object.call(member.name, given, PATIENT)
          : member.kind === "property"
            ? await object.set(member.name, given[0], PATIENT)
            : await object.poke(member.name, given[0], PATIENT);
      const hasResult = member.kind === "function" && member.type !== "void";
      const entry: Done = {
        time: Date.now(),
        form,
        words: JSON.stringify(jsonOf(given)).slice(1, -1),
        rows: hasResult ? rowsOf(result, member.type, definitions, scope) : [],
        tookMs: performance.now() - begun,
      };
      setDone((old) => [entry, ...old.slice(0, MOST_DONE - 1)]);
    });
  };
  const isReadable = member.kind === "property" && !member.modifiers.includes("writeonly");
  const read = (): void =>
    doing.run(async () => {
      if (object) showRead(await object.get(member.name));
    });
  // What a property is, on each connection, not a 0 that nobody gave it; and never over what was typed in meanwhile.
  useEffect(() => {
    if (!object || !isReadable) return;
    let isWanted = true;
    object.get(member.name).then(
      (value) => isWanted && !isTouched.current && showRead(value),
      () => undefined, // whoever presses Read learns why
    );
    return () => void (isWanted = false);
  }, [object, member, definitions]);
  const isPlain = fields.length === 0 && !withMore; // beside others of its kind its name says it all
  const word = member.kind === "function" ? t("Call") : member.kind === "property" ? t("Set") : t("Send");
  const [newest] = done;
  return (
    <form class={`member-form ${isPlain ? "is-plain" : ""}`} onSubmit={submit} data-form={member.name}>
      {fields.map(({ name, type, draft, change }) => (
        <DraftInput
          key={name}
          label={name}
          {...{ type, definitions, scope, draft }}
          change={(next) => touch(() => change(next))}
        />
      ))}
      <div class="row-line">
        <button class="button" type="submit" disabled={!object || doing.busy}>
          {isPlain ? <span class="unseen">{word} </span> : `${word} `}
          {member.name}
        </button>
        {isReadable && (
          <button class="button button-quiet" type="button" disabled={!object || doing.busy} onClick={read}>
            {t("Read")}
            <span class="unseen"> {member.name}</span>
          </button>
        )}
        {doing.busy && <span class="note">{t("under way …")}</span>}
        {newest && !doing.busy && (
          <output class="form-result">
            {newest.rows.length === 0 ? t("done") : newest.rows.length === 1 ? newest.rows[0]?.text : ""}{" "}
            <small class="took">{newest.tookMs.toFixed(1)} ms</small>
          </output>
        )}
      </div>
      {newest && newest.rows.length > 1 && (
        <table class="value-table">
          <tbody>
            {newest.rows.map((row, i) => (
              <tr key={i}>
                <th scope="row">{row.name}</th>
                <td>{row.text}</td>
              </tr>
            ))}
          </tbody>
        </table>
      )}
      <Refusal failure={doing.failure ?? lost} isLocked={doing.isLocked} object={object} place={place} />
      {member.documentation !== "" && withMore && <p class="note row-documentation">{flowing(member.documentation)}</p>}
      {withMore && done.length > 0 && <History done={done} take={(before) => touch(() => fill(before))} />}
      {withMore && <Code member={member} values={values} place={place} types={{ definitions, scope }} />}
    </form>
  );
}

function History({ done, take }: { done: readonly Done[]; take: (form: FormDrafts) => void }) {
  return (
    <details>
      <summary>{t("History: {0}", done.length)}</summary>
      <ol class="history">
        {done.map(({ time, words, form }, i) => (
          <li key={i}>
            <time>{clockTime(time)}</time>{" "}
            <button class="button button-quiet" type="button" onClick={() => take(form)}>
              {words || t("without arguments")}
            </button>
          </li>
        ))}
      </ol>
    </details>
  );
}

/** Loaded when it is opened for the first time. */
function Code(props: CodeProps) {
  const [wasOpen, setWasOpen] = useState(false);
  return (
    <details onToggle={() => setWasOpen(true)}>
      <summary>{t("Copy as code")}</summary>
      {wasOpen && <LoadedCode {...props} />}
    </details>
  );
}
