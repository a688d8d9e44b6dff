// An event: a log of the times it was heard while this page is open, newest first.
// Layer: web/members.

import { useEffect, useState } from "preact/hooks";
import { t } from "../app/language";
import { explain } from "../robot/remote";
import { Failure } from "../ui/failure";
import { formatArguments, Log, useLog } from "./log";
import { RowHead } from "./row";
import type { MemberRowProps } from "./row";

export function EventRow({ object, member, live }: MemberRowProps) {
  const log = useLog();
  const [failure, setFailure] = useState<string | null>(null);
  useEffect(() => {
    if (!live) return;
    setFailure(null);
    try {
      return object.on(member.name, (...args) => log.add(formatArguments(member, args)));
    } catch (error) {
      setFailure(explain(error));
      return undefined;
    }
  }, [object, member, live]);
  return (
    <>
      <RowHead member={member} signature={`(${member.parameters.map((p) => `${p.type} ${p.name}`).join(", ")})`} />
      <Failure text={failure} />
      {log.entries.length === 0 ? (
        <p class="note">{live ? t("Listening. Nothing heard yet.") : t("Not connected.")}</p>
      ) : (
        <Log name={member.name} entries={log.entries} />
      )}
    </>
  );
}
