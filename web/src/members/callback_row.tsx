// A callback: what this page answers when the device asks, and a log of what it was asked.
// Layer: web/members.

import { useEffect, useRef, useState } from "preact/hooks";
import { t } from "../app/language";
import { explain } from "../robot/remote";
import { Failure } from "../ui/failure";
import { parseInput } from "../values/parse";
import { formatArguments, Log, useLog } from "./log";
import { RowHead } from "./row";
import type { MemberRowProps } from "./row";
import { initialText, ValueInput } from "./value_input";

export function CallbackRow({ object, member, live }: MemberRowProps) {
  const [answering, setAnswering] = useState(false);
  const [text, setText] = useState(initialText(member.type));
  const [failure, setFailure] = useState<string | null>(null);
  const log = useLog();
  const answer = useRef(text);
  answer.current = text;
  useEffect(() => {
    if (!live || !answering) return;
    setFailure(null);
    try {
      return object.answer(member.name, (...args) => {
        log.add(formatArguments(member, args));
        return member.type === "void" ? undefined : parseInput(answer.current, member.type);
      });
    } catch (error) {
      setFailure(explain(error));
      return undefined;
    }
  }, [object, member, live, answering]);
  const signature = `(${member.parameters.map((p) => `${p.type} ${p.name}`).join(", ")}) → ${member.type}`;
  return (
    <>
      <RowHead member={member} signature={signature} />
      <div class="row-line">
        {member.type !== "void" && (
          <ValueInput
            quiet
            label={t("Answer of {0}", member.name)}
            type={member.type}
            text={text}
            disabled={!live}
            onText={setText}
          />
        )}
        <button
          class="button"
          type="button"
          disabled={!live}
          aria-pressed={answering}
          onClick={() => setAnswering(!answering)}
        >
          {answering ? t("Stop answering") : t("Answer")}
          <span class="unseen"> {member.name}</span>
        </button>
      </div>
      <Failure text={failure} />
      {log.entries.length > 0 && <Log name={member.name} entries={log.entries} />}
    </>
  );
}
