// The USB devices that this page may use, and the way to one of them. Layer: wasm-client/ts.
// Source: hardware spec sections 1 and 2.1.
import { makeError, textOf } from "../errors.js";
import type { RobotRaconteurError } from "../errors.js";
import type { Transport, TransportListener } from "../transport.js";
import type { UsbNode } from "../usb_devices.js";
import { nameOf } from "./bus.js";
import { UsbClaim } from "./claim.js";
import type { UsbNodeName } from "./claim.js";
import type { WebUsb, WebUsbDevice } from "./webusb.js";

const vendorClass = 0xff;
const anyId = "00000000-0000-0000-0000-000000000000";

/**
 * A stream of the node that `url` names, on whichever device it is.
 * @throws RobotRaconteurError InvalidArgument: `nodeid`; ConnectionError: no device is that node. Everything later is told to
 *         `listener`.
 */
export async function openStream(usb: WebUsb, url: URL, listener: TransportListener): Promise<Transport> {
  const id = plainId(url.searchParams.get("nodeid"));
  const name = url.searchParams.get("nodename");
  const devices = await grantedDevices(usb);
  if (devices.length === 0) {
    const what =
      "this page may use no USB device, or none is plugged in; let the user choose one with requestUsbDevice()";
    throw makeError("ConnectionError", `${url.href}: ${what}`);
  }
  const check = (device: WebUsbDevice, node: UsbNodeName): void => {
    if ((id === undefined || id === plainId(node.id)) && (!name || name === node.name)) return;
    throw makeError("NodeNotFound", `${nameOf(device)}: is node ${node.id}${node.name && ` "${node.name}"`}`);
  };
  let found: Transport | undefined;
  const attempts = devices.map(async (device) => {
    const known = UsbClaim.known(device);
    if (known) check(device, known);
    return UsbClaim.use(usb, device, (claim, node) => {
      check(device, node);
      return (found ??= claim.openStream(listener));
    });
  });
  try {
    return await Promise.any(attempts);
  } catch (error) {
    const reasons = (error as AggregateError).errors.map(textOf).join("; ");
    throw makeError("ConnectionError", `${url.href}: found on none of this page's USB devices: ${reasons}`);
  }
}

/** Those that may be nodes, asked who they are. */
export async function listNodes(usb: WebUsb): Promise<UsbNode[]> {
  const devices = await grantedDevices(usb);
  return Promise.all(
    devices.map((device) =>
      describe(usb, device).catch((error: RobotRaconteurError) => ({
        device: nameOf(device),
        nodeId: "",
        nodeName: "",
        error,
      })),
    ),
  );
}

/** @throws RobotRaconteurError ConnectionError: it is no node, or cannot be asked. */
export async function describe(usb: WebUsb, device: WebUsbDevice): Promise<UsbNode & { readonly url: string }> {
  if (!mayBeNode(device)) {
    throw makeError(
      "ConnectionError",
      `${nameOf(device)}: is no Robot Raconteur device (it needs USB 2.1 and a vendor specific interface)`,
    );
  }
  const node = UsbClaim.known(device) ?? (await UsbClaim.use(usb, device, (_, node) => node));
  const who = node.id === anyId ? `nodename=${node.name}` : `nodeid=${node.id}`;
  return { device: nameOf(device), nodeId: node.id, nodeName: node.name, url: `rr+usb:///?${who}` };
}

async function grantedDevices(usb: WebUsb): Promise<WebUsbDevice[]> {
  try {
    return (await usb.getDevices()).filter(mayBeNode);
  } catch (error) {
    throw makeError(
      "SystemResourcePermissionDenied",
      `this page may not use USB: ${textOf(error)}; a frame needs allow="usb"`,
    );
  }
}

/** What a look at the descriptors leaves as possible: older devices have no BOS. */
function mayBeNode(device: WebUsbDevice): boolean {
  const version = (device.usbVersionMajor << 8) | (device.usbVersionMinor << 4) | device.usbVersionSubminor;
  return (
    version >= 0x0201 &&
    (device.deviceClass === 0 || device.deviceClass === vendorClass) &&
    (device.configurations[0]?.interfaces ?? []).some(({ alternates }) =>
      alternates.some((alternate) => alternate.alternateSetting === 0 && alternate.interfaceClass === vendorClass),
    )
  );
}

/** 32 hexadecimal digits: NodeIDs may be written with braces and dashes, or without. */
function plainId(text: string | null): string | undefined {
  if (text === null) return undefined;
  const plain = text.replace(/[{}-]/g, "").toLowerCase();
  if (/^[0-9a-f]{32}$/.test(plain)) return plain;
  throw makeError(
    "InvalidArgument",
    `nodeid "${text.slice(0, 64)}": expected the like of 82301bf1-e1ef-4e89-8d8f-0848291587ac`,
  );
}
