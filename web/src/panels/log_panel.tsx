// The events of an object as they come, newest first, and only those that have the words asked for.
// Layer: web/panels.

import { useEffect, useRef, useState } from "preact/hooks";
import { t } from "../app/language";
import { openFeed } from "../live/feed";
import { formatArguments } from "../members/log";
import type { Member, Remote } from "../robot/remote";
import { explain } from "../robot/remote";
import { Failure } from "../ui/failure";
import { clockTimeMs } from "../ui/words";
import { textIn } from "./panel";
import type { PanelProps } from "./panel";
import "./log_panel.css";

interface Entry {
  number: number;
  time: number;
  name: string;
  text: string;
}

const MOST = 200;
const SHOW_MS = 100;

export default function LogPanel({ object, members, settings, change }: PanelProps) {
  const events = members.filter(({ kind }) => kind === "event");
  const [entries, setEntries] = useState<readonly Entry[]>([]);
  const kept = useRef<readonly Entry[]>([]);
  const [failure, setFailure] = useState<string | null>(null);
  const filter = textIn(settings, "filter");
  useEffect(() => {
    if (!object) return;
    setFailure(null);
    try {
      const closes = events.map((event) => listen(object, event, (entry) => (kept.current = add(kept.current, entry))));
      return () => closes.forEach((close) => close());
    } catch (error) {
      setFailure(explain(error));
      return undefined;
    }
  }, [object]);
  useEffect(() => {
    const timer = setInterval(() => setEntries(kept.current), SHOW_MS); // events may come a thousand times a second
    return () => clearInterval(timer);
  }, []);
  const clear = (): void => setEntries((kept.current = []));
  const wanted = filter.toLowerCase();
  const shown = entries.filter(({ name, text }) => `${name} ${text}`.toLowerCase().includes(wanted));
  return (
    <div class="log-panel">
      <div class="panel-tools">
        <label class="panel-select">
          <span class="unseen">{t("Show only")}</span>
          <input
            class="field"
            type="search"
            placeholder={t("Show only")}
            value={filter}
            onInput={(event) => change({ filter: event.currentTarget.value })}
          />
        </label>
        <button class="button button-quiet" type="button" onClick={clear}>
          {t("Clear")}
        </button>
      </div>
      <Failure text={failure} />
      <ol class="log panel-scroll" tabIndex={0} aria-label={t("Events")}>
        {shown.map(({ number, time, name, text }) => (
          <li key={number}>
            <time class="log-time">{clockTimeMs(time)}</time>
            <strong>{name}</strong> <span>{text}</span>
          </li>
        ))}
      </ol>
      {shown.length === 0 && (
        <p class="note">
          {events.length === 0
            ? t("This object has no events.")
            : object
              ? t("Listening to {0}. Nothing heard yet.", events.map(({ name }) => name).join(", "))
              : t("not connected")}
        </p>
      )}
    </div>
  );
}

function listen(object: Remote, event: Member, heard: (entry: Omit<Entry, "number">) => void): () => void {
  const { feed, close } = openFeed(object, "event", event.name);
  const hear = (args: unknown): void =>
    heard({ time: Date.now(), name: event.name, text: formatArguments(event, args as unknown[]) });
  feed.heard.add(hear);
  return () => (feed.heard.delete(hear), close());
}

function add(entries: readonly Entry[], entry: Omit<Entry, "number">): readonly Entry[] {
  return [{ ...entry, number: (entries[0]?.number ?? 0) + 1 }, ...entries.slice(0, MOST - 1)];
}
