// A property: its value, read when shown and on request, and a field to set it.
// Layer: web/members.

import { useEffect, useRef, useState } from "preact/hooks";
import { t } from "../app/language";
import { placeOf } from "../app/router";
import { Failure } from "../ui/failure";
import { useAge } from "../ui/use_age";
import { formatValue } from "../values/format";
import { parseInput } from "../values/parse";
import { Refusal } from "./refusal";
import { PATIENT, RowHead, useAction } from "./row";
import type { MemberRowProps } from "./row";
import { initialText, ValueInput } from "./value_input";

export function PropertyRow({ object, member, live, route }: MemberRowProps) {
  const readable = !member.modifiers.includes("writeonly");
  const writable = !member.modifiers.includes("readonly");
  const reading = useAction();
  const writing = useAction();
  const [shown, setShown] = useState<string | null>(null);
  const [text, setText] = useState(initialText(member.type));
  const readAt = useRef<number | null>(null);
  const isCurrent = live && reading.failure === null;
  const age = useAge(() => (isCurrent ? null : readAt.current));
  const read = (): void =>
    reading.run(async () => {
      setShown(formatValue(await object.get(member.name)));
      readAt.current = performance.now();
    });
  useEffect(() => {
    if (live && readable) read();
  }, [object, live]);
  const write = (event: Event): void => {
    event.preventDefault();
    writing.run(async () => {
      await object.set(member.name, parseInput(text, member.type), PATIENT);
      if (readable) read(); // what fails there says nothing of what was set
    });
  };
  return (
    <>
      <RowHead member={member} />
      {readable && (
        <div class={`row-line ${age === null ? "" : "is-stale"}`}>
          <output class="value">{shown ?? (reading.busy ? t("reading …") : t("not read"))}</output>
          <button class="button" type="button" disabled={!live || reading.busy} onClick={read}>
            {t("Read")}
            <span class="unseen"> {member.name}</span>
          </button>
          {age !== null && <p class="note">{t("Stale: {0}", age)}</p>}
        </div>
      )}
      <Failure text={reading.failure} />
      {writable && (
        <form class="row-line" onSubmit={write}>
          <ValueInput
            quiet
            label={t("New value of {0}", member.name)}
            type={member.type}
            text={text}
            disabled={!live}
            onText={setText}
          />
          <button class="button" type="submit" disabled={!live || writing.busy}>
            {t("Set")}
            <span class="unseen"> {member.name}</span>
          </button>
        </form>
      )}
      <Refusal
        failure={writing.failure}
        isLocked={writing.isLocked}
        object={live ? object : null}
        place={placeOf(route)}
      />
    </>
  );
}
