// The devices of the gateway: a few as cards, many as lines that open, searched and in groups.
// Layer: web/pages.

import { useMemo, useState } from "preact/hooks";
import { t } from "../app/language";
import type { Device, DeviceState } from "../gateway/devices";
import { ClassIcon } from "../ui/class_icon";
import { StateBadge } from "../ui/state_badge";
import { useWindowedList } from "../ui/window_list";
import { DeviceCard, ServiceLink } from "./device_card";
import { ANY, GROUPINGS, keepWish, recallWish, STATES, typesOf, wanted } from "./device_wish";
import type { Wish } from "./device_wish";

const FEW = 6; // are looked through as they are
const CARD_PX = 220;
const LINE_PX = 61;

type Item = { key: string } & ({ group: string; count: number } | { device: Device; at: number });

export function DeviceParts({ devices, stale }: { devices: readonly Device[]; stale: boolean }) {
  const [wish, setWish] = useState(recallWish);
  const isMany = devices.length > FEW;
  const asked = isMany ? wish : ANY;
  const groups = useMemo(() => wanted(devices, asked), [devices, asked]);
  const change = (next: Partial<Wish>): void => {
    const changed = { ...wish, ...next };
    setWish(changed);
    keepWish(changed);
  };
  const found = groups.reduce((sum, group) => sum + group.devices.length, 0);
  let at = 0;
  const items = groups.flatMap(({ name, devices: members }): Item[] => [
    ...(asked.group === "" ? [] : [{ key: `group ${name}`, group: name, count: members.length }]),
    ...members.map((device) => ({ key: `device ${device.name}`, device, at: ++at })),
  ]);
  return (
    <section aria-label={t("Devices of the gateway")}>
      {isMany && <WishBar wish={wish} devices={devices} found={found} change={change} />}
      <Items items={items} count={found} isMany={isMany} stale={stale} />
      {found === 0 && (
        <div class="empty">
          <p>{t("No device is like that.")}</p>
          <button class="button" type="button" onClick={() => change({ ...ANY, group: wish.group })}>
            {t("Show all")}
          </button>
        </div>
      )}
    </section>
  );
}

interface ItemsProps {
  items: readonly Item[];
  count: number;
  isMany: boolean;
  stale: boolean;
}

function Items({ items, count, isMany, stale }: ItemsProps) {
  const [open, setOpen] = useState<ReadonlySet<string>>(new Set());
  const { part, list } = useWindowedList(
    items.map(({ key }) => key),
    isMany ? LINE_PX : CARD_PX,
  );
  const toggle = (name: string): void => {
    const next = new Set(open);
    if (!next.delete(name)) next.add(name);
    setOpen(next);
  };
  return (
    <ul
      ref={list}
      class={`device-list ${isMany ? "is-dense" : ""} ${stale ? "is-stale" : ""}`}
      style={{ paddingTop: `${part.before}px`, paddingBottom: `${part.behind}px` }}
    >
      {items.slice(part.from, part.to).map((item) =>
        "group" in item ? (
          <li key={item.key} data-key={item.key} class="device-group">
            <h2>
              {item.group === "" ? t("type not read yet") : t(item.group)} <small>{item.count}</small>
            </h2>
          </li>
        ) : (
          <li key={item.key} data-key={item.key} aria-setsize={count} aria-posinset={item.at}>
            <div class="device" data-device={item.device.name}>
              {isMany && !open.has(item.device.name) ? (
                <DeviceLine device={item.device} stale={stale} toggle={() => toggle(item.device.name)} />
              ) : (
                <DeviceCard device={item.device} stale={stale} />
              )}
              {isMany && open.has(item.device.name) && (
                <button class="button button-quiet" type="button" onClick={() => toggle(item.device.name)}>
                  {t("Less")}
                </button>
              )}
            </div>
          </li>
        ),
      )}
    </ul>
  );
}

function DeviceLine({ device, stale, toggle }: { device: Device; stale: boolean; toggle: () => void }) {
  return (
    <div class="device-line">
      <ClassIcon types={device.services.map(({ type }) => type)} />
      <div class="device-line-name">
        <h2>{device.name}</h2>
        <p class="code" title={device.url}>
          {device.url}
        </p>
      </div>
      <ul class="device-line-services">
        {device.services.map((service) => (
          <li key={service.name}>
            <ServiceLink device={device} service={service} />
          </li>
        ))}
      </ul>
      <StateBadge state={device.state} text={stale ? t("was {0}", t(device.state)) : t(device.state)} />
      <button class="button button-quiet" type="button" aria-label={t("More of {0}", device.name)} onClick={toggle}>
        {t("More")}
      </button>
    </div>
  );
}

interface WishBarProps {
  wish: Wish;
  devices: readonly Device[];
  found: number;
  change: (next: Partial<Wish>) => void;
}

const GROUPS: Readonly<Record<Wish["group"], string>> = { "": "no groups", state: "by state", type: "by type" };

function WishBar({ wish, devices, found, change }: WishBarProps) {
  const types = useMemo(() => typesOf(devices), [devices]);
  const all = types.includes(wish.type) || wish.type === "" ? types : [wish.type, ...types];
  return (
    <search class="wish-bar">
      <input
        class="field"
        type="search"
        aria-label={t("Search devices")}
        placeholder={t("Search by name, address, service or type")}
        value={wish.words}
        onInput={(event) => change({ words: event.currentTarget.value })}
      />
      <select
        class="field"
        aria-label={t("State")}
        value={wish.state}
        onChange={(event) => change({ state: event.currentTarget.value as DeviceState | "" })}
      >
        <option value="">{t("all states")}</option>
        {STATES.map((state) => (
          <option key={state} value={state}>
            {t(state)}
          </option>
        ))}
      </select>
      <select
        class="field"
        aria-label={t("Type")}
        value={wish.type}
        onChange={(event) => change({ type: event.currentTarget.value })}
      >
        <option value="">{t("all types")}</option>
        {all.map((type) => (
          <option key={type} value={type}>
            {type}
          </option>
        ))}
      </select>
      <select
        class="field"
        aria-label={t("Groups")}
        value={wish.group}
        onChange={(event) => change({ group: GROUPINGS.find((each) => each === event.currentTarget.value) ?? "" })}
      >
        {GROUPINGS.map((group) => (
          <option key={group} value={group}>
            {t(GROUPS[group])}
          </option>
        ))}
      </select>
      <p class="note" role="status">
        {t("{0} of {1}", found, devices.length)}
      </p>
    </search>
  );
}
