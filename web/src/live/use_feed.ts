// Feeds in components: followed while shown, looked at ten times a second.
// Layer: web/live.

import { useEffect, useRef, useState } from "preact/hooks";
import type { Remote } from "../robot/remote";
import { openFeed } from "./feed";
import { formatRate } from "./rate";
import type { Feed, FeedKind, Heard } from "./feed";
import { span } from "../ui/words";
import { t } from "../app/language";

const LOOK_MS = 100;

export interface Look {
  feed: Feed | null;
  value: unknown;
  failure: string | null;
  /** How old the value is, once it is; null while new ones come. */
  stale: string | null;
  /** A second; 0 where nothing regular comes. */
  rate: number;
}

const NOTHING: Look = { feed: null, value: undefined, failure: null, stale: null, rate: 0 };

/** The newest of a member, at most ten times a second. What was known stays, and ages, when `object` goes. */
export function useFeed(object: Remote | null, kind: FeedKind | null, member: string): Look {
  const [look, setLook] = useState<Look>(NOTHING);
  const last = useRef<Feed | null>(null);
  useEffect(() => {
    if (!object || kind === null) return;
    const { feed, close } = openFeed(object, kind, member);
    last.current = feed;
    return close;
  }, [object, kind, member]);
  useEffect(() => {
    const timer = setInterval(() => {
      const feed = last.current;
      if (!feed || feed.member !== member) return;
      const next = lookAt(feed, feed.object === object, performance.now());
      setLook((old) =>
        old.feed === next.feed &&
        old.value === next.value &&
        old.failure === next.failure &&
        old.stale === next.stale &&
        formatRate(old.rate) === formatRate(next.rate)
          ? old
          : next,
      );
    }, LOOK_MS);
    return () => clearInterval(timer);
  }, [object, member]);
  return look.feed?.member === member ? look : NOTHING; // not what another member said
}

/** Calls `heard` with each value. */
export function useEach(object: Remote | null, kind: FeedKind | null, member: string, heard: Heard): Feed | null {
  const latest = useRef({ object, member, heard });
  latest.current = { object, member, heard };
  const [feed, setFeed] = useState<Feed | null>(null);
  useEffect(() => {
    if (!object || kind === null) return;
    const opened = openFeed(object, kind, member);
    const hear: Heard = (...given) => {
      const { current } = latest;
      if (current.object === object && current.member === member) current.heard(...given); // else it is about to end
    };
    opened.feed.heard.add(hear);
    setFeed(opened.feed);
    return () => {
      opened.feed.heard.delete(hear);
      opened.close();
    };
  }, [object, kind, member]);
  return feed;
}

/** `isLive`: whether it is of the object that there is now; what another said is old. */
export function lookAt(feed: Feed, isLive: boolean, now: number): Look {
  const age = feed.pace.ageMs(now);
  const isStale = age !== null && (feed.pace.isStale(now) || (!isLive && age > 250));
  return {
    feed,
    value: feed.newest,
    failure: feed.failure,
    stale: isStale ? t("{0} old", oldness(age)) : null,
    rate: feed.pace.rate(now),
  };
}

/** Whether what `look` says is what the device has now: to be acted on. `object`: that which is connected. */
export function isFresh({ feed, stale, failure }: Look, object: Remote | null): boolean {
  return object !== null && feed?.object === object && stale === null && failure === null;
}

/** `0.4 s`, `12 s`, `3 min`. */
export function oldness(ms: number): string {
  return ms < 9950 ? `${(ms / 1000).toFixed(1)} s` : span(ms);
}
