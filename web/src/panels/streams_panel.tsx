// What this page follows: how often it comes, how old it is; and, where an account of it is kept, how long it waited on the way
// and what was lost there.
// Layer: web/panels.

import { useEffect, useMemo } from "preact/hooks";
import { t } from "../app/language";
import { useNow, useStore } from "../app/store";
import { itemsOf } from "../gateway/polled_list";
import { subscriptionsAt } from "../gateway/subscriptions";
import type { Subscription } from "../gateway/subscriptions";
import { isUsb } from "../gateway/usb_devices";
import { openFeeds } from "../live/feed";
import type { Feed } from "../live/feed";
import { pause } from "../live/pause";
import { formatRate } from "../live/rate";
import { oldness } from "../live/use_feed";
import type { PanelProps } from "./panel";

type Losses = Awaited<ReturnType<NonNullable<Feed["account"]>["losses"]>>;

const ACCOUNT_MS = 3_000;

export default function StreamsPanel({ place }: PanelProps) {
  useNow(250);
  const list = useMemo(() => subscriptionsAt(place.device), [place.device]);
  useEffect(() => {
    if (isUsb(place.device)) return;
    list.start();
    return () => list.stop();
  }, [list]);
  const lost = itemsOf(useStore(list.state)) ?? [];
  const own = useOwnLosses();
  const now = performance.now();
  return (
    <div class="panel-scroll" tabIndex={0} role="group" aria-label={t("Streams")}>
      <table class="value-table streams-table">
        <thead>
          <tr>
            <th scope="col">{t("Stream")}</th>
            <th scope="col">{t("Rate")}</th>
            <th scope="col">{t("Age")}</th>
            <th scope="col">{t("Waited at the gateway")}</th>
            <th scope="col">{t("Replaced or dropped")}</th>
          </tr>
        </thead>
        <tbody>
          {openFeeds().map((feed, i) => {
            const age = feed.pace.ageMs(now);
            // The list is of the panel's device; another one may have an object of the same path.
            const isOfList = feed.object.device === place.device;
            const account = isOfList ? lost.filter((each) => isOf(each, feed)) : [];
            const missed = account.reduce((sum, { conflated, dropped }) => sum + conflated + dropped, 0);
            const here = own.get(feed);
            return (
              <tr key={i} class={feed.pace.isStale(now) ? "is-old" : ""}>
                <th scope="row">
                  {feed.member}{" "}
                  <small>
                    {t(feed.kind)}, {feed.object.path}
                  </small>
                </th>
                <td>{t("{0} a second", formatRate(feed.pace.rate(now)))}</td>
                <td>{age === null ? "–" : oldness(age)}</td>
                <td>{here ? t("half {0} ms, 99 % {1} ms", here.ageP50, here.ageP99) : "–"}</td>
                <td>
                  {[
                    ...(here ? [t("{0} here", here.conflated + here.dropped)] : []),
                    ...(account.length > 0 ? [t("{0} for all clients", missed)] : []),
                  ].join(", ") || "–"}
                </td>
              </tr>
            );
          })}
        </tbody>
      </table>
    </div>
  );
}

function isOf({ path, member, kind }: Subscription, feed: Feed): boolean {
  return path === feed.object.path && member === feed.member && kind === feed.kind;
}

/** Of this page's own connections, asked again every few seconds. */
function useOwnLosses(): WeakMap<Feed, Losses> {
  const known = useMemo(() => new WeakMap<Feed, Losses>(), []);
  useEffect(() => {
    const stop = new AbortController();
    const look = async (feed: Feed): Promise<void> => {
      // One that fails tells nothing: the strip says why.
      known.set(feed, await feed.account?.losses({ signal: stop.signal }).catch(() => undefined));
    };
    const follow = async (): Promise<void> => {
      while (!stop.signal.aborted) {
        if (!document.hidden) await Promise.all(openFeeds().map(look));
        await pause(ACCOUNT_MS, stop.signal);
      }
    };
    void follow();
    return () => stop.abort();
  }, []);
  return known;
}
