// A wire: its newest value, how often one comes, and a plot of the numbers in it; and a field to send one.
// Layer: web/members.

import { useMemo } from "preact/hooks";
import { t } from "../app/language";
import { Plot } from "../chart/plot";
import { formatRate } from "../live/rate";
import { useEach, useFeed } from "../live/use_feed";
import { Series } from "../robot/series";
import { Failure } from "../ui/failure";
import { formatValue } from "../values/format";
import { readingsOf } from "../values/numeric";
import { PATIENT, RowHead } from "./row";
import type { MemberRowProps } from "./row";
import { ValueForm } from "./value_form";

export function WireRow(props: MemberRowProps) {
  const { object, member, live } = props;
  const readable = !member.modifiers.includes("writeonly");
  const writable = !member.modifiers.includes("readonly");
  return (
    <>
      <RowHead member={member} />
      {readable && <WireReader object={object} name={member.name} live={live} />}
      {writable && (
        <ValueForm
          {...props}
          label={t("Value to send on {0}", member.name)}
          word={t("Send")}
          give={(value) => object.poke(member.name, value, PATIENT)}
        />
      )}
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
