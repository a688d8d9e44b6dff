// A wire: its newest value, how often one comes, and a plot of the numbers in it; and a field to send one.
// Layer: web/members.

import { useEffect, useMemo, useState } from "preact/hooks";
import { t } from "../app/language";
import { Plot } from "../chart/plot";
import { Pace } from "../live/pace";
import { formatRate } from "../live/rate";
import { explain } from "../robot/remote";
import { Series } from "../robot/series";
import { Failure } from "../ui/failure";
import { useAge } from "../ui/use_age";
import { formatValue } from "../values/format";
import { readingsOf } from "../values/numeric";
import { parseInput } from "../values/parse";
import { RowHead, useAction } from "./row";
import type { MemberRowProps } from "./row";
import { initialText, ValueInput } from "./value_input";

const SHOW_MS = 100;

export function WireRow({ object, member, live }: MemberRowProps) {
  const readable = !member.modifiers.includes("writeonly");
  const writable = !member.modifiers.includes("readonly");
  return (
    <>
      <RowHead member={member} />
      {readable && <WireReader object={object} name={member.name} live={live} />}
      {writable && <WireWriter object={object} name={member.name} type={member.type} live={live} />}
    </>
  );
}

function WireReader({ object, name, live }: { object: MemberRowProps["object"]; name: string; live: boolean }) {
  const pace = useMemo(() => new Pace(), []);
  const byLabel = useMemo(() => new Map<string, Series>(), []);
  const [labels, setLabels] = useState<readonly string[]>([]);
  const [text, setText] = useState<string | null>(null);
  const [rate, setRate] = useState(0);
  const [failure, setFailure] = useState<string | null>(null);
  const age = useAge(() => pace.heardAt);

  useEffect(() => {
    if (!live) return;
    const stop = new AbortController();
    let newest: unknown;
    let fresh = false;
    const follow = async (): Promise<void> => {
      for await (const value of object.wire(name, stop.signal)) {
        const now = performance.now();
        newest = value;
        fresh = true;
        pace.hear(now);
        const readings = readingsOf(value);
        for (const { label, value: number } of readings) {
          const series = byLabel.get(label) ?? new Series();
          byLabel.set(label, series);
          series.push(now, number);
        }
      }
    };
    setFailure(null);
    follow().catch((error: unknown) => {
      if (!stop.signal.aborted) setFailure(explain(error));
    });
    // Values may come a thousand times a second; the text follows ten times.
    const timer = setInterval(() => {
      setRate(pace.rate(performance.now()));
      if (!fresh) return;
      fresh = false;
      setText(formatValue(newest));
      setLabels((old) => (old.length === byLabel.size ? old : [...byLabel.keys()]));
    }, SHOW_MS);
    return () => {
      clearInterval(timer);
      stop.abort();
    };
  }, [object, name, live, pace, byLabel]);

  const lines = useMemo(
    () => labels.map((label) => byLabel.get(label)).filter((s) => s !== undefined),
    [labels, byLabel],
  );
  return (
    <>
      <div class={`wire ${age === null ? "" : "is-stale"}`}>
        <output class="value wire-value">{text ?? (live ? t("no value yet") : t("not connected"))}</output>
        {lines.length > 0 && (
          <div class="wire-plot">
            <Plot series={lines} label={t("Plot of {0} over the last 30 seconds", name)} live={live} />
            <ul class="legend">
              {labels.map((label, i) => (
                <li key={label} class={`legend-${(i % 6) + 1}`}>
                  {label === "" ? name : label}
                </li>
              ))}
            </ul>
          </div>
        )}
      </div>
      <p class="note">
        {rate > 0 ? t("{0} values a second", formatRate(rate)) : t("no regular values")}
        {age !== null && t("; this one is {0}", age)}
      </p>
      <Failure text={failure} />
    </>
  );
}

function WireWriter({
  object,
  name,
  type,
  live,
}: {
  object: MemberRowProps["object"];
  name: string;
  type: string;
  live: boolean;
}) {
  const [text, setText] = useState(initialText(type));
  const sending = useAction();
  const send = (event: Event): void => {
    event.preventDefault();
    sending.run(async () => object.poke(name, parseInput(text, type)));
  };
  return (
    <>
      <form class="row-line" onSubmit={send}>
        <ValueInput
          quiet
          label={t("Value to send on {0}", name)}
          type={type}
          text={text}
          disabled={!live}
          onText={setText}
        />
        <button class="button" type="submit" disabled={!live || sending.busy}>
          {t("Send")}
          <span class="unseen"> {name}</span>
        </button>
      </form>
      <Failure text={sending.failure} />
    </>
  );
}
