// USB devices in a page, by WebUSB: what is loaded at once, so that a click may lead to the browser's chooser. The rest
// comes when there is a device to speak to. Layer: wasm-client/ts. Source: hardware spec section 2.1.
import { makeError, textOf } from "./errors.js";
import type { RobotRaconteurError } from "./errors.js";
import type { OpenTransport } from "./transport.js";
import type { UsbFilter, WebUsb } from "./usb/webusb.js";

export type { UsbFilter };

/** A USB device that this page may use, and the node that it is. */
export type UsbNode = {
  /** For people: 'USB device "Robot" (1209:5252)'. */
  readonly device: string;
  readonly nodeId: string;
  /** May be empty. */
  readonly nodeName: string;
} & (
  | {
      /** "rr+usb:///?nodeid=..."; with "&service=NAME" behind it what connect() takes. Not there where `error` is. */
      readonly url: string;
      readonly error?: undefined;
    }
  | {
      readonly url?: undefined;
      /** Why the device could not be asked who it is. */
      readonly error: RobotRaconteurError;
    }
);

/**
 * Lets the user choose a USB device, which this page may use from then on. Call it from a click, a key or a touch.
 * @param filters  which devices are offered; all that may be nodes (those with a vendor specific interface).
 * @throws RobotRaconteurError OperationCancelled: nothing was chosen; InvalidOperation: no click, or a worker;
 *         SystemResourceError: no WebUSB here; ConnectionError: the device is no node, or cannot be asked.
 */
export async function requestUsbDevice(
  filters: UsbFilter[] = [{ classCode: 0xff }],
): Promise<UsbNode & { readonly url: string }> {
  const usb = findUsb();
  if (!usb.requestDevice)
    throw makeError("InvalidOperation", "a worker cannot ask the user for a USB device: ask in the page");
  const device = await usb.requestDevice({ filters }).catch((error: unknown) => {
    if ((error as Error).name === "NotFoundError") throw makeError("OperationCancelled", "no USB device was chosen");
    throw makeError("InvalidOperation", `the user cannot be asked for a USB device: ${textOf(error)}`);
  });
  return (await load()).describe(usb, device);
}

/**
 * The devices that this page may use already and that are plugged in, those left out that cannot be nodes.
 * @throws RobotRaconteurError SystemResourceError: no WebUSB here; SystemResourcePermissionDenied: not for this frame.
 */
export async function listUsbDevices(): Promise<UsbNode[]> {
  return (await load()).listNodes(findUsb());
}

/** A device that was granted; `nodeid` and `nodename` of the URL say which. */
export const openUsb: OpenTransport = async (url, listener) => (await load()).openStream(findUsb(), url, listener);

const load = () => import("./usb/nodes.js");

function findUsb(): WebUsb {
  const { navigator, isSecureContext } = globalThis as { navigator?: { usb?: WebUsb }; isSecureContext?: boolean };
  if (navigator?.usb) return navigator.usb;
  const why =
    isSecureContext === false
      ? "pages that came without encryption may not use USB; serve this one by https:, or from localhost"
      : "this browser has no WebUSB, which Chromium, Chrome and Edge have; elsewhere connect through a gateway";
  throw makeError("SystemResourceError", `rr+usb: ${why}`);
}
