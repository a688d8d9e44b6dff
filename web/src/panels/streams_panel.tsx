// What this page follows: how often it comes, how old it is; and what the gateway lost on the way, where it keeps an account.
// Layer: web/panels.

import { useEffect, useMemo } from "preact/hooks";
import { t } from "../app/language";
import { useNow, useStore } from "../app/store";
import { itemsOf } from "../gateway/polled_list";
import { subscriptionsAt } from "../gateway/subscriptions";
import { isUsb } from "../gateway/usb_devices";
import { openFeeds } from "../live/feed";
import { formatRate } from "../live/rate";
import { oldness } from "../live/use_feed";
import type { PanelProps } from "./panel";

export default function StreamsPanel({ place }: PanelProps) {
  useNow(250);
  const list = useMemo(() => subscriptionsAt(place.device), [place.device]);
  useEffect(() => {
    if (isUsb(place.device)) return;
    list.start();
    return () => list.stop();
  }, [list]);
  const lost = itemsOf(useStore(list.state)) ?? [];
  const now = performance.now();
  return (
    <div class="panel-scroll" tabIndex={0} role="group" aria-label={t("Streams")}>
      <table class="value-table streams-table">
        <thead>
          <tr>
            <th scope="col">{t("Stream")}</th>
            <th scope="col">{t("Rate")}</th>
            <th scope="col">{t("Age")}</th>
            <th scope="col">{t("Replaced or dropped")}</th>
          </tr>
        </thead>
        <tbody>
          {openFeeds().map((feed, i) => {
            const age = feed.pace.ageMs(now);
            const account = lost.filter(({ member, kind }) => member === feed.member && kind === feed.kind);
            const missed = account.reduce((sum, { conflated, dropped }) => sum + conflated + dropped, 0);
            return (
              <tr key={i} class={feed.pace.isStale(now) ? "is-old" : ""}>
                <th scope="row">
                  {feed.member} <small>{t(feed.kind)}</small>
                </th>
                <td>{t("{0} a second", formatRate(feed.pace.rate(now)))}</td>
                <td>{age === null ? "–" : oldness(age)}</td>
                <td>{account.length === 0 ? "–" : t("{0} (all clients)", missed)}</td>
              </tr>
            );
          })}
        </tbody>
      </table>
    </div>
  );
}
