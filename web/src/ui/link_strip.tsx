// Says plainly whether the page is connected: always there, always the same height, so nothing jumps.
// Layer: web/ui.

import { t } from "../app/language";
import { useNow, useStore } from "../app/store";
import { devicesOf } from "../gateway/devices";
import type { Device, DeviceList, GatewayState } from "../gateway/devices";
import { isUsb } from "../gateway/usb_devices";
import type { Link, LinkState } from "../robot/link";
import { StateBadge } from "./state_badge";
import { clockTime, sentence, span } from "./words";

export interface LinkStripProps {
  link: Link;
  list: DeviceList;
  device: string;
  service: string;
}

export function LinkStrip({ link, list, device, service }: LinkStripProps) {
  const state = useStore(link.state);
  const lost = state.kind === "lost";
  const badge = lost ? "offline" : state.kind;
  return (
    <section class={`link-strip link-${badge}`} aria-label={t("Connection")} data-link={state.kind}>
      <StateBadge
        state={badge}
        text={t({ online: "connected", connecting: "connecting", offline: "not connected" }[badge])}
      />
      <div class="link-words">
        {/* Only what changes rarely is announced; the seconds beside it are for the eye. */}
        <p class="link-head" role="status">
          {headline(state, device, service)}
        </p>
        <p class="link-detail">
          {lost ? (
            <LostDetail state={state} list={list} device={device} />
          ) : (
            <FoundDetail state={state} list={list} device={device} />
          )}
        </p>
      </div>
      <button class="button" type="button" hidden={!lost} onClick={() => link.retryNow()}>
        {t("Try now")}
      </button>
    </section>
  );
}

function headline(state: LinkState, device: string, service: string): string {
  if (state.kind === "connecting") return t("Connecting to {0}, service {1}", device, service);
  if (state.kind === "online") return t("Connected since {0}", clockTime(state.since));
  return t("No connection to {0} since {1}", device, clockTime(state.since));
}

interface DetailProps<State> {
  state: State;
  list: DeviceList;
  device: string;
}

function FoundDetail({ state, list, device }: DetailProps<Exclude<LinkState, { kind: "lost" }>>) {
  const gateway = useStore(list.state);
  if (state.kind === "connecting")
    return isUsb(device) ? t("Asking this browser for the device") : t("Asking the gateway for the device");
  const known = devicesOf(gateway)?.find((d) => d.name === device);
  return known?.state === "offline" ? saidOf(known) : state.remote.type; // a connection of one's own may tell it later
}

function LostDetail({ state, list, device }: DetailProps<LinkState & { kind: "lost" }>) {
  const now = useNow(500);
  const gateway = useStore(list.state);
  const next = state.retryAt <= now ? t("trying now") : t("next try in {0}", span(state.retryAt - now + 999));
  const why = isUsb(device) ? sentence(state.reason) : reasonOf(state, gateway, device);
  return (
    <>
      {why}
      <span class="link-since" aria-hidden="true">
        {t("Away for {0}; {1}.", span(now - state.since), next)}
      </span>
    </>
  );
}

/** What the gateway says of the device tells more than the connection that failed. */
function reasonOf(state: LinkState & { kind: "lost" }, gateway: GatewayState, device: string): string {
  if (gateway.kind === "away") return t("The gateway itself does not answer ({0}).", gateway.reason);
  const devices = devicesOf(gateway);
  const known = devices?.find((d) => d.name === device);
  if (devices && !known) return t('The gateway has no device "{0}" any more.', device);
  if (!known || known.state === "online") return sentence(state.reason);
  return saidOf(known);
}

function saidOf({ state, lastError }: Device): string {
  return t("The gateway says: device {0}.", [t(state), ...(lastError ? [lastError] : [])].join(", "));
}
