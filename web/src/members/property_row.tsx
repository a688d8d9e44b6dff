// A property: its value, read when shown and on request, and a field to set it.
// Layer: web/members.

import { useEffect, useState } from "preact/hooks";
import { t } from "../app/language";
import { Failure } from "../ui/failure";
import { formatValue } from "../values/format";
import { parseInput } from "../values/parse";
import { RowHead, useAction } from "./row";
import type { MemberRowProps } from "./row";
import { initialText, ValueInput } from "./value_input";

export function PropertyRow({ object, member, live }: MemberRowProps) {
  const readable = !member.modifiers.includes("writeonly");
  const writable = !member.modifiers.includes("readonly");
  const reading = useAction();
  const writing = useAction();
  const [shown, setShown] = useState<string | null>(null);
  const [text, setText] = useState(initialText(member.type));
  const read = (): void => reading.run(async () => setShown(formatValue(await object.get(member.name))));
  useEffect(() => {
    if (live && readable) read();
  }, [object, live]);
  const write = (event: Event): void => {
    event.preventDefault();
    writing.run(async () => {
      await object.set(member.name, parseInput(text, member.type));
      if (readable) setShown(formatValue(await object.get(member.name)));
    });
  };
  return (
    <>
      <RowHead member={member} />
      {readable && (
        <div class="row-line">
          <output class="value">{shown ?? (reading.busy ? t("reading …") : t("not read"))}</output>
          <button class="button" type="button" disabled={!live || reading.busy} onClick={read}>
            {t("Read")}
            <span class="unseen"> {member.name}</span>
          </button>
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
      <Failure text={writing.failure} />
    </>
  );
}
