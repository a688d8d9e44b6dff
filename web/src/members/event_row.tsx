// An event: a log of the times it was heard while this page is open, newest first.
// Layer: web/members.

import { useEffect, useState } from "preact/hooks";
import { explain } from "../robot/remote";
import { Failure } from "../ui/failure";
import { clock_time_ms } from "../ui/words";
import { format_value } from "../values/format";
import { RowHead } from "./row";
import type { MemberRowProps } from "./row";

const MAX_HEARD = 50;

interface Heard {
  number: number;
  time: number;
  text: string;
}

export function EventRow({ object, member, live }: MemberRowProps) {
  const [log, set_log] = useState<readonly Heard[]>([]);
  const [failure, set_failure] = useState<string | null>(null);
  useEffect(() => {
    if (!live) return;
    set_failure(null);
    try {
      return object.on(member.name, (...args) => {
        const named = member.parameters.map((p, i) => `${p.name}: ${format_value(args[i], 1)}`);
        set_log((old) => [
          { number: (old[0]?.number ?? 0) + 1, time: Date.now(), text: named.join(", ") },
          ...old.slice(0, MAX_HEARD - 1),
        ]);
      });
    } catch (error) {
      set_failure(explain(error));
      return undefined;
    }
  }, [object, member, live]);
  return (
    <>
      <RowHead member={member} signature={`(${member.parameters.map((p) => `${p.type} ${p.name}`).join(", ")})`} />
      <Failure text={failure} />
      {log.length === 0 ? (
        <p class="note">{live ? "Listening. Nothing heard yet." : "Not connected."}</p>
      ) : (
        <ol class="log" tabIndex={0} aria-label={`Log of ${member.name}`}>
          {log.map((heard) => (
            <li key={heard.number}>
              <span class="log-number">{heard.number}</span>
              <time class="log-time">{clock_time_ms(heard.time)}</time>
              <span>{heard.text}</span>
            </li>
          ))}
        </ol>
      )}
    </>
  );
}
