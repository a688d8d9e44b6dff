// What panels share: choosing a member, and saying how fresh a value is.
// Layer: web/panels.

import { t } from "../app/language";
import { formatRate } from "../live/rate";
import type { Look } from "../live/use_feed";
import type { FeedKind } from "../live/feed";
import type { Member } from "../robot/remote";

export function MemberSelect({
  members,
  chosen,
  choose,
  label = t("Member"),
}: {
  members: readonly Member[];
  chosen: string;
  choose: (name: string) => void;
  label?: string;
}) {
  return (
    <label class="panel-select">
      <span class="unseen">{label}</span>
      <select class="field" value={chosen} onChange={(event) => choose(event.currentTarget.value)}>
        {!members.some(({ name }) => name === chosen) && (
          <option value={chosen}>{chosen === "" ? t("Choose a member") : chosen}</option>
        )}
        <MemberOptions members={members} />
      </select>
    </label>
  );
}

export function MemberOptions({ members }: { members: readonly Member[] }) {
  return (
    <>
      {members.map(({ name, kind }) => (
        <option key={name} value={name}>
          {name} ({t(kind)})
        </option>
      ))}
    </>
  );
}

/** Nothing while values come; how old they are where they don't. */
export function Freshness({ look, isLive }: { look: Look; isLive: boolean }) {
  const words = look.failure ?? (look.stale !== null && t("Stale: {0}", look.stale));
  const heard = look.feed?.pace.count ?? 0;
  return (
    <p
      class={look.failure !== null ? "failure" : `freshness ${look.stale === null ? "" : "is-old"}`}
      data-stale={look.stale !== null}
    >
      {words ||
        (look.rate > 0
          ? t("{0} a second", formatRate(look.rate))
          : heard > 0
            ? t("no regular values")
            : isLive
              ? t("no value yet")
              : t("not connected"))}
    </p>
  );
}

export function feedKindOf(member: Member | undefined): FeedKind | null {
  const kind = member?.kind;
  return kind === "wire" || kind === "pipe" || kind === "property" || kind === "event" ? kind : null;
}
