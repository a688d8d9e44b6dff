// What the clients of a shared device listen to, and what each has lost. Closed at first; asks only while it is open.
// Layer: web/pages.

import { t } from "../app/language";
import { itemsOf } from "../gateway/polled_list";
import { subscriptionsAt } from "../gateway/subscriptions";
import type { Subscription } from "../gateway/subscriptions";
import { Folded } from "../ui/folded";
import { Ledger } from "../ui/ledger";
import { ageText } from "../ui/words";
import { headline, usePolled } from "./polled";

interface Props {
  device: string;
  online: boolean;
  stale: boolean;
}

export function SubscriptionsPart({ device, online, stale }: Props) {
  const summary = (
    <>
      {t("Subscriptions")}
      <span class="unseen"> {device}</span>
    </>
  );
  return (
    <Folded summary={summary}>
      <Subscriptions device={device} online={online} stale={stale} />
    </Folded>
  );
}

function Subscriptions({ device, online, stale }: Props) {
  const state = usePolled(() => subscriptionsAt(device));
  const subscriptions = itemsOf(state);
  const known = ({ length }: Subscription[]): string => {
    if (!online && !stale) return t("The device is away: nothing comes until it is back, and then they go on.");
    if (length === 0) return t("No client listens to a wire or a pipe of it now.");
    return t("Wires and pipes of each client, since it connected them.");
  };
  return (
    <div data-subscriptions={state.kind}>
      <p class="note" role="status">
        {headline(state, known)}
      </p>
      {state.kind === "loading" && <span class="bone" aria-hidden="true" />}
      {subscriptions && subscriptions.length > 0 && <Table device={device} subscriptions={subscriptions} />}
    </div>
  );
}

const COLUMNS = ["Member", "Client", "Delivered", "Conflated", "Dropped", "Age p50", "Age p99"];

function Table({ device, subscriptions }: { device: string; subscriptions: Subscription[] }) {
  return (
    <Ledger label={t("Subscriptions of {0}", device)} columns={COLUMNS} hints={HINTS}>
      {subscriptions.map((each, row) => (
        <Row key={`${each.path}.${each.member} ${each.client} ${row}`} subscription={each} />
      ))}
    </Ledger>
  );
}

const HINTS: Readonly<Record<string, string>> = {
  Delivered: "Values handed to the client's connection",
  Conflated: "Values of a wire that a newer one replaced before there was room",
  Dropped: "Values lost otherwise",
  "Age p50": "Half of the values were not older than this when they were handed on",
  "Age p99": "99 of 100 values were not older than this when they were handed on",
};

function Row({ subscription }: { subscription: Subscription }) {
  const { path, member, kind, client, delivered, conflated, dropped, ageP50Ms, ageP99Ms } = subscription;
  const aged = (ms: number): string => (delivered > 0 ? ageText(ms) : t("none yet"));
  const cells: [name: string, value: string, mark: string][] = [
    ["Client", client === "" ? t("unknown") : client, "code"],
    ["Delivered", String(delivered), ""],
    ["Conflated", String(conflated), conflated > 0 ? "is-conflated" : ""],
    ["Dropped", String(dropped), dropped > 0 ? "is-dropped" : ""],
    ["Age p50", aged(ageP50Ms), ""],
    ["Age p99", aged(ageP99Ms), ""],
  ];
  return (
    <tr role="row" data-member={member}>
      <th role="rowheader" scope="row">
        <span class="code">
          {path}.<wbr />
          {member}
        </span>{" "}
        <span class="note">{t(kind)}</span>
      </th>
      {cells.map(([name, value, mark]) => (
        <td key={name} role="cell" class={mark} data-label={t(name)}>
          {value}
        </td>
      ))}
    </tr>
  );
}
