// The newest of what comes by itself: events, packets, calls of the device.
// Layer: web/members.

import { useMemo, useState } from "preact/hooks";
import { t } from "../app/language";
import type { Member } from "../robot/remote";
import { clockTimeMs } from "../ui/words";
import { formatValue } from "../values/format";

const MAX_ENTRIES = 50;

export interface LogEntry {
  number: number;
  time: number;
  text: string;
}

/** Entries, newest first, and how to add one. */
export function useLog(): { entries: readonly LogEntry[]; add(text: string): void } {
  const [entries, setEntries] = useState<readonly LogEntry[]>([]);
  const add = useMemo(
    () => (text: string) =>
      setEntries((old) => [
        { number: (old[0]?.number ?? 0) + 1, time: Date.now(), text },
        ...old.slice(0, MAX_ENTRIES - 1),
      ]),
    [],
  );
  return { entries, add };
}

/** "value: 3, why: 'reset'". */
export function formatArguments(member: Member, args: readonly unknown[]): string {
  return member.parameters.map((p, i) => `${p.name}: ${formatValue(args[i], 1)}`).join(", ");
}

export function Log({ name, entries }: { name: string; entries: readonly LogEntry[] }) {
  return (
    <ol class="log" tabIndex={0} aria-label={t("Log of {0}", name)}>
      {entries.map((entry) => (
        <li key={entry.number}>
          <span class="log-number">{entry.number}</span>
          <time class="log-time">{clockTimeMs(entry.time)}</time>
          <span>{entry.text}</span>
        </li>
      ))}
    </ol>
  );
}
