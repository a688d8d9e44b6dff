// A connection to a service of a device, which hears what the gateway says of the device meanwhile.
// Layer: web/gateway.

import { Link } from "../robot/link";
import { relayUrl } from "./devices";
import type { DeviceList, GatewayState } from "./devices";
import { session } from "./session";
import { isUsb, usbUrl } from "./usb_devices";

export function linkTo(
  device: string,
  service: string,
  list: Pick<DeviceList, "answers">,
): { link: Link; dispose: () => void } {
  const url = relayUrl(device, service);
  const link = new Link(isUsb(device) ? usbUrl(device, service) : () => session.withTicket(url), device);
  const unwatch = list.answers.watch(follow(link, device));
  const dispose = (): void => {
    unwatch();
    link.dispose();
  };
  return { link, dispose };
}

/**
 * Only a shared device is away because the gateway says so: another may have a client of its own, and no ear for the gateway.
 * @returns what is called with each list of devices.
 */
export function follow(link: Pick<Link, "setAway" | "retryNow">, device: string): (gateway: GatewayState) => void {
  let wasOnline = true;
  return (gateway) => {
    const known = gateway.kind === "known" ? gateway.devices.find((each) => each.name === device) : undefined;
    const isOnline = known?.state === "online";
    if (known?.state === "offline" && known.mode === "shared") link.setAway(known.lastError ?? "offline");
    if (isOnline) link.setAway(null);
    if (isOnline && !wasOnline) link.retryNow();
    wasOnline = isOnline;
  };
}
