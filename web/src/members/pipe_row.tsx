// A pipe: its packets while they are followed, newest first, and a field to send one.
// Layer: web/members.

import { useEffect, useState } from "preact/hooks";
import { t } from "../app/language";
import { explain } from "../robot/remote";
import { Failure } from "../ui/failure";
import { formatValue } from "../values/format";
import { Log, useLog } from "./log";
import { RowHead } from "./row";
import type { MemberRowProps } from "./row";

export function PipeRow({ object, member, live }: MemberRowProps) {
  const [following, setFollowing] = useState(false);
  const [failure, setFailure] = useState<string | null>(null);
  const log = useLog();
  useEffect(() => {
    if (!live || !following) return;
    const stop = new AbortController();
    setFailure(null);
    const follow = async (): Promise<void> => {
      for await (const packet of object.pipe(member.name, stop.signal)) log.add(formatValue(packet, 1));
      if (!stop.signal.aborted) throw new Error("the device closed this pipe");
    };
    follow().catch((error: unknown) => {
      if (stop.signal.aborted) return;
      setFailure(explain(error));
      setFollowing(false);
    });
    return () => stop.abort();
  }, [object, member, live, following]);
  return (
    <>
      <RowHead member={member} />
      {!member.modifiers.includes("writeonly") && (
        <div class="row-line">
          <button
            class="button"
            type="button"
            disabled={!live}
            aria-pressed={following}
            onClick={() => setFollowing(!following)}
          >
            {following ? t("Stop") : t("Follow")}
            <span class="unseen"> {member.name}</span>
          </button>
          {following && log.entries.length === 0 && <p class="note">{t("Connected. No packet yet.")}</p>}
        </div>
      )}
      <Failure text={failure} />
      {log.entries.length > 0 && <Log name={member.name} entries={log.entries} />}
    </>
  );
}
