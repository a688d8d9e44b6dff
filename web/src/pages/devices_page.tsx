// The first page: which devices are behind this gateway or plugged into this computer, how they are, and what they offer.
// Layer: web/pages.

import { t } from "../app/language";
import { useNow, useStore } from "../app/store";
import { devicesOf } from "../gateway/devices";
import type { DeviceList, GatewayState } from "../gateway/devices";
import type { UsbDeviceList } from "../gateway/usb_devices";
import type { AccessDesk } from "../gateway/access";
import type { AgentsDesk } from "../gateway/agents";
import { AccessPart } from "./access_part";
import { AgentSessionsPart } from "./agent_sessions_part";
import { AuditPart } from "./audit_part";
import { DeviceCard } from "./device_card";
import { DeviceParts } from "./device_parts";
import { StateBadge } from "../ui/state_badge";
import { clockTime, ended, sentence, span } from "../ui/words";
import "../styles/devices.css";

export interface DevicesPageProps {
  list: DeviceList;
  usb: UsbDeviceList;
  access: AccessDesk;
  agents: AgentsDesk;
}

export default function DevicesPage({ list, usb, access, agents }: DevicesPageProps) {
  const state = useStore(list.state);
  const devices = devicesOf(state);
  return (
    <div class="page page-narrow">
      <div class="service-head">
        <h1>{t("Devices")}</h1>
        <GatewayStrip state={state} />
      </div>
      {state.kind === "loading" && <LoadingRows />}
      {devices && devices.length === 0 && state.kind === "known" && <NoDevices />}
      {devices && devices.length > 0 && <DeviceParts devices={devices} stale={state.kind === "away"} />}
      {usb.isPossible && <UsbPart usb={usb} />}
      <AccessPart access={access} />
      <AgentSessionsPart agents={agents} />
      <AuditPart />
    </div>
  );
}

/** Devices that are plugged into the computer where this page is shown; the gateway knows nothing of them. */
function UsbPart({ usb }: { usb: UsbDeviceList }) {
  const devices = useStore(usb.devices);
  const trouble = useStore(usb.trouble);
  return (
    <section class="usb-part" aria-label={t("USB devices of this computer")}>
      {devices.length > 0 && (
        <ul class="devices">
          {devices.map((device) => (
            <li key={device.name} class="device" data-device={device.name}>
              <DeviceCard device={device} stale={false} />
            </li>
          ))}
        </ul>
      )}
      <button class="button" type="button" onClick={() => void usb.choose()}>
        {t("Connect USB device")}
      </button>
      {trouble !== null && (
        <p class="failure" role="alert">
          {sentence(trouble)}
        </p>
      )}
    </section>
  );
}

/** Like the strip of a connection: always there, always the same height. */
function GatewayStrip({ state }: { state: GatewayState }) {
  const badge = { loading: "connecting", known: "online", away: "offline" } as const;
  return (
    <section class={`link-strip link-${badge[state.kind]}`} aria-label={t("Gateway")} data-gateway={state.kind}>
      <StateBadge
        state={badge[state.kind]}
        text={t({ loading: "asking", known: "gateway", away: "gateway away" }[state.kind])}
      />
      <div class="link-words">
        <p class="link-head" role="status">
          {headline(state)}
        </p>
        <p class="link-detail">{state.kind === "away" ? <AwayDetail state={state} /> : location.host}</p>
      </div>
    </section>
  );
}

function headline(state: GatewayState): string {
  if (state.kind === "loading") return t("Asking the gateway for its devices");
  if (state.kind === "away") return t("The gateway does not answer since {0}", clockTime(state.since));
  const online = state.devices.filter((device) => device.state === "online").length;
  return state.devices.length === 0
    ? t("No devices configured")
    : t("{0} of {1} devices online", online, state.devices.length);
}

function AwayDetail({ state }: { state: GatewayState & { kind: "away" } }) {
  const now = useNow(1000);
  return (
    <>
      {location.host}: {ended(state.reason)}
      {state.devices && state.devices.length > 0 && ` ${t("Below is what it said last.")}`}
      <span class="link-since" aria-hidden="true">
        {t("Away for {0}; asking every 2 s.", span(now - state.since))}
      </span>
    </>
  );
}

function LoadingRows() {
  return (
    <ul class="devices" aria-hidden="true">
      {[0, 1].map((row) => (
        <li key={row} class="device device-loading">
          <span class="bone bone-title" />
          <span class="bone" />
          <span class="bone bone-service" />
        </li>
      ))}
    </ul>
  );
}

const EXAMPLE = `{
  "listen": ["127.0.0.1:8080"],
  "devices": [
    { "name": "create",
      "url": "rr+tcp://127.0.0.1:52222/?service=Create" }
  ]
}`;

function NoDevices() {
  return (
    <section class="empty">
      <h2 class="place-name">{t("No devices yet")}</h2>
      <p>{t("This gateway knows no devices yet. Name one in its configuration and it appears here by itself:")}</p>
      <pre class="code">{EXAMPLE}</pre>
      <p>
        {t("Or start the simulated robot:")} <code>rrgate demo</code>
      </p>
    </section>
  );
}
