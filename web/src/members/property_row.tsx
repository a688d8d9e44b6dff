// A property: its value, read when shown and on request, and a field to set it.
// Layer: web/members.

import { useEffect, useState } from "preact/hooks";
import { Failure } from "../ui/failure";
import { format_value } from "../values/format";
import { parse_input } from "../values/parse";
import { RowHead, useAction } from "./row";
import type { MemberRowProps } from "./row";
import { initial_text, ValueInput } from "./value_input";

export function PropertyRow({ object, member, live }: MemberRowProps) {
  const readable = !member.modifiers.includes("writeonly");
  const writable = !member.modifiers.includes("readonly");
  const reading = useAction();
  const writing = useAction();
  const [shown, set_shown] = useState<string | null>(null);
  const [text, set_text] = useState(initial_text(member.type));
  const read = (): void => reading.run(async () => set_shown(format_value(await object.get(member.name))));
  useEffect(() => {
    if (live && readable) read();
  }, [object, live]);
  const write = (event: Event): void => {
    event.preventDefault();
    writing.run(async () => {
      await object.set(member.name, parse_input(text, member.type));
      if (readable) set_shown(format_value(await object.get(member.name)));
    });
  };
  return (
    <>
      <RowHead member={member} />
      {readable && (
        <div class="row-line">
          <output class="value">{shown ?? (reading.busy ? "reading …" : "not read")}</output>
          <button class="button" type="button" disabled={!live || reading.busy} onClick={read}>
            Read<span class="unseen"> {member.name}</span>
          </button>
        </div>
      )}
      <Failure text={reading.failure} />
      {writable && (
        <form class="row-line" onSubmit={write}>
          <ValueInput quiet label={`New value of ${member.name}`} type={member.type} text={text} disabled={!live} on_text={set_text} />
          <button class="button" type="submit" disabled={!live || writing.busy}>
            Set<span class="unseen"> {member.name}</span>
          </button>
        </form>
      )}
      <Failure text={writing.failure} />
    </>
  );
}
