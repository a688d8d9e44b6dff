// A wire: its newest value, how often one comes, and a plot of the numbers in it; and a field to send one.
// Layer: web/members.

import { useMemo, useState } from "preact/hooks";
import { t } from "../app/language";
import { placeOf } from "../app/router";
import { Plot } from "../chart/plot";
import { formatRate } from "../live/rate";
import { useEach, useFeed } from "../live/use_feed";
import { Series } from "../robot/series";
import { Failure } from "../ui/failure";
import { formatValue } from "../values/format";
import { readingsOf } from "../values/numeric";
import { parseInput } from "../values/parse";
import { Refusal } from "./refusal";
import { PATIENT, RowHead, useAction } from "./row";
import type { MemberRowProps } from "./row";
import { initialText, ValueInput } from "./value_input";

export function WireRow({ object, member, live, route }: MemberRowProps) {
  const readable = !member.modifiers.includes("writeonly");
  const writable = !member.modifiers.includes("readonly");
  return (
    <>
      <RowHead member={member} />
      {readable && <WireReader object={object} name={member.name} live={live} />}
      {writable && <WireWriter object={object} name={member.name} type={member.type} live={live} route={route} />}
    </>
  );
}

function WireReader({ object, name, live }: { object: MemberRowProps["object"]; name: string; live: boolean }) {
  const reach = live ? object : null;
  const byLabel = useMemo(() => new Map<string, Series>(), []);
  const look = useFeed(reach, "wire", name);
  useEach(reach, "wire", name, (value, now) => {
    for (const { label, value: number } of readingsOf(value)) {
      const series = byLabel.get(label) ?? new Series();
      byLabel.set(label, series);
      series.push(now, number);
    }
  });
  const lines = useMemo(() => [...byLabel.values()], [byLabel.size, byLabel]);
  return (
    <>
      <div class={`wire ${look.stale === null ? "" : "is-stale"}`}>
        <output class="value wire-value">
          {look.value === undefined ? (live ? t("no value yet") : t("not connected")) : formatValue(look.value)}
        </output>
        {lines.length > 0 && (
          <div class="wire-plot">
            <Plot series={lines} label={t("Plot of {0} over the last 30 seconds", name)} live={live} />
            <ul class="legend">
              {[...byLabel.keys()].map((label, i) => (
                <li key={label} class={`legend-${(i % 6) + 1}`}>
                  {label === "" ? name : label}
                </li>
              ))}
            </ul>
          </div>
        )}
      </div>
      <p class="note">
        {look.rate > 0 ? t("{0} values a second", formatRate(look.rate)) : t("no regular values")}
        {look.stale !== null && t("; this one is {0}", look.stale)}
      </p>
      <Failure text={look.failure} />
    </>
  );
}

function WireWriter({
  object,
  name,
  type,
  live,
  route,
}: Omit<MemberRowProps, "member"> & { name: string; type: string }) {
  const [text, setText] = useState(initialText(type));
  const sending = useAction();
  const send = (event: Event): void => {
    event.preventDefault();
    sending.run(async () => object.poke(name, parseInput(text, type), PATIENT));
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
      <Refusal
        failure={sending.failure}
        isLocked={sending.isLocked}
        object={live ? object : null}
        place={placeOf(route)}
      />
    </>
  );
}
