// A wire: its newest value, how often one comes, and a plot of the numbers in it; and a field to send one.
// Layer: web/members.

import { useEffect, useMemo, useState } from "preact/hooks";
import { Plot } from "../chart/plot";
import { explain } from "../robot/remote";
import { rate_of, Series } from "../robot/series";
import { Failure } from "../ui/failure";
import { useAge } from "../ui/use_age";
import { format_value } from "../values/format";
import { readings_of } from "../values/numeric";
import { parse_input } from "../values/parse";
import { RowHead, useAction } from "./row";
import type { MemberRowProps } from "./row";
import { initial_text, ValueInput } from "./value_input";

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
  const arrivals = useMemo(() => new Series(5_000, 5_000), []);
  const by_label = useMemo(() => new Map<string, Series>(), []);
  const [labels, set_labels] = useState<readonly string[]>([]);
  const [text, set_text] = useState<string | null>(null);
  const [rate, set_rate] = useState(0);
  const [failure, set_failure] = useState<string | null>(null);
  const age = useAge(() => arrivals.newest?.t ?? null);

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
        arrivals.push(now, 1);
        const readings = readings_of(value);
        for (const { label, value: number } of readings) {
          const series = by_label.get(label) ?? new Series();
          by_label.set(label, series);
          series.push(now, number);
        }
      }
    };
    set_failure(null);
    follow().catch((error: unknown) => {
      if (!stop.signal.aborted) set_failure(explain(error));
    });
    // Values may come a thousand times a second; the text follows ten times.
    const timer = setInterval(() => {
      set_rate(rate_of(arrivals, performance.now()));
      if (!fresh) return;
      fresh = false;
      set_text(format_value(newest));
      set_labels((old) => (old.length === by_label.size ? old : [...by_label.keys()]));
    }, SHOW_MS);
    return () => {
      clearInterval(timer);
      stop.abort();
    };
  }, [object, name, live, arrivals, by_label]);

  const lines = useMemo(() => labels.map((label) => by_label.get(label)).filter((s) => s !== undefined), [labels, by_label]);
  return (
    <>
      <div class={`wire ${age === null ? "" : "is-stale"}`}>
        <output class="value wire-value">{text ?? (live ? "no value yet" : "not connected")}</output>
        {lines.length > 0 && (
          <div class="wire-plot">
            <Plot series={lines} label={`Plot of ${name} over the last 30 seconds`} live={live} />
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
        {rate > 0 ? `${rate.toFixed(1)} values a second` : "no values in the last 2 s"}
        {age !== null && `; this one is ${age}`}
      </p>
      <Failure text={failure} />
    </>
  );
}

function WireWriter({ object, name, type, live }: { object: MemberRowProps["object"]; name: string; type: string; live: boolean }) {
  const [text, set_text] = useState(initial_text(type));
  const sending = useAction();
  const send = (event: Event): void => {
    event.preventDefault();
    sending.run(async () => object.poke(name, parse_input(text, type)));
  };
  return (
    <>
      <form class="row-line" onSubmit={send}>
        <ValueInput quiet label={`Value to send on ${name}`} type={type} text={text} disabled={!live} on_text={set_text} />
        <button class="button" type="submit" disabled={!live || sending.busy}>
          Send<span class="unseen"> on {name}</span>
        </button>
      </form>
      <Failure text={sending.failure} />
    </>
  );
}
