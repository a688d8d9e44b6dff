// A callback: what this page answers when the device asks, and a log of what it was asked.
// Layer: web/members.

import { useEffect, useRef, useState } from "preact/hooks";
import { explain } from "../robot/remote";
import { Failure } from "../ui/failure";
import { parse_input } from "../values/parse";
import { format_arguments, Log, useLog } from "./log";
import { RowHead } from "./row";
import type { MemberRowProps } from "./row";
import { initial_text, ValueInput } from "./value_input";

export function CallbackRow({ object, member, live }: MemberRowProps) {
  const [answering, set_answering] = useState(false);
  const [text, set_text] = useState(initial_text(member.type));
  const [failure, set_failure] = useState<string | null>(null);
  const log = useLog();
  const answer = useRef(text);
  answer.current = text;
  useEffect(() => {
    if (!live || !answering) return;
    set_failure(null);
    try {
      return object.answer(member.name, (...args) => {
        log.add(format_arguments(member, args));
        return member.type === "void" ? undefined : parse_input(answer.current, member.type);
      });
    } catch (error) {
      set_failure(explain(error));
      return undefined;
    }
  }, [object, member, live, answering]);
  const signature = `(${member.parameters.map((p) => `${p.type} ${p.name}`).join(", ")}) → ${member.type}`;
  return (
    <>
      <RowHead member={member} signature={signature} />
      <div class="row-line">
        {member.type !== "void" && (
          <ValueInput quiet label={`Answer of ${member.name}`} type={member.type} text={text} disabled={!live} on_text={set_text} />
        )}
        <button class="button" type="button" disabled={!live} aria-pressed={answering} onClick={() => set_answering(!answering)}>
          {answering ? "Stop answering" : "Answer"}
          <span class="unseen"> {member.name}</span>
        </button>
      </div>
      <Failure text={failure} />
      {log.entries.length > 0 && <Log name={member.name} entries={log.entries} />}
    </>
  );
}
