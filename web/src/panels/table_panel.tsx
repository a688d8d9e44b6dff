// The newest value of a member, field by field: enums and flags in words, UUIDs as such; or as JSON.
// Layer: web/panels.

import { useMemo } from "preact/hooks";
import { useFeed } from "../live/use_feed";
import { jsonOf } from "../values/draft";
import { rowsOf } from "../values/rows";
import { membersFor, textIn } from "./panel";
import type { PanelProps } from "./panel";
import { feedKindOf, Freshness, MemberSelect } from "./parts";

export default function TablePanel({ object, members, settings, change, definitions, scope }: PanelProps) {
  const choices = membersFor("table", members);
  const name = textIn(settings, "member") || choices[0]?.name || "";
  const member = choices.find((each) => each.name === name);
  const look = useFeed(object, feedKindOf(member), name);
  const asJson = settings["json"] === true;
  const rows = useMemo(
    () => (asJson || look.value === undefined ? [] : rowsOf(look.value, member?.type ?? "", definitions, scope)),
    [look.value, asJson, member?.type, definitions],
  );
  return (
    <div class="table-panel">
      <div class="panel-tools">
        <MemberSelect members={choices} chosen={name} choose={(next) => change({ ...settings, member: next })} />
        <button
          class="button button-quiet"
          type="button"
          aria-pressed={asJson}
          onClick={() => change({ ...settings, member: name, json: !asJson })}
        >
          JSON
        </button>
      </div>
      <div class={`panel-scroll ${look.stale === null ? "" : "is-stale"}`} tabIndex={0} role="group" aria-label={name}>
        {asJson ? (
          <pre class="json">{look.value === undefined ? "" : shortJson(look.value)}</pre>
        ) : (
          <table class="value-table">
            <tbody>
              {rows.map(({ path, depth, name: field, text, note }) => (
                <tr key={path}>
                  <th scope="row" class={`depth-${depth}`} title={note || undefined}>
                    {field === "" ? name : field}
                  </th>
                  <td data-value={path}>{text}</td>
                </tr>
              ))}
            </tbody>
          </table>
        )}
      </div>
      <Freshness look={look} isLive={object !== null} />
    </div>
  );
}

const MOST_JSON = 20_000;

function shortJson(value: unknown): string {
  const text = JSON.stringify(jsonOf(value), null, 2) ?? "";
  return text.length > MOST_JSON ? `${text.slice(0, MOST_JSON)}…` : text;
}
