// The USB devices that this browser speaks to by itself, past the gateway, where it has WebUSB.
// Layer: web/gateway. Beside robot/remote.ts the only file that imports `rrgate-client`.

import { connect, ErrorCode, listUsbDevices, requestUsbDevice, RobotRaconteurError } from "rrgate-client";
import type { UsbNode } from "rrgate-client";
import { Store } from "../app/store";
import type { Device, Service } from "./devices";

const MARK = "usb:";
const INDEX = "RobotRaconteurServiceIndex";

export class UsbDeviceList {
  /** Whether this browser can; nothing else here makes sense where it cannot. */
  readonly isPossible = usbOfBrowser() !== undefined;
  readonly devices = new Store<Device[]>([]);
  /** Why choosing or listing failed. */
  readonly trouble = new Store<string | null>(null);
  #round = 0;

  start(): void {
    usbOfBrowser()?.addEventListener("connect", () => void this.#refresh());
    usbOfBrowser()?.addEventListener("disconnect", () => void this.#refresh());
    if (this.isPossible) void this.#refresh();
  }

  /** From a click: the browser asks which device this page may use. */
  async choose(): Promise<void> {
    this.trouble.value = null;
    try {
      await requestUsbDevice();
    } catch (error) {
      const isCancelled = error instanceof RobotRaconteurError && error.code === ErrorCode.OperationCancelled;
      if (!isCancelled) this.trouble.value = (error as Error).message;
    }
    await this.#refresh();
  }

  readonly #refresh = async (): Promise<void> => {
    const round = ++this.#round;
    try {
      const allowed = await usbOfBrowser()?.getDevices();
      // What asks them who they are is loaded where there are some.
      const devices = allowed?.length ? await Promise.all((await listUsbDevices()).map(describe)) : [];
      if (round === this.#round) this.devices.value = devices;
    } catch (error) {
      if (round === this.#round) this.trouble.value = (error as Error).message;
    }
  };
}

/** Whether a device's name is one of this list. */
export function isUsb(device: string): boolean {
  return device.startsWith(MARK);
}

/** Where a service of such a device is: by the node's id, or its name. */
export function usbUrl(device: string, service: string): string {
  const who = device.slice(MARK.length);
  const key = /^[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}$/.test(who) ? "nodeid" : "nodename";
  return `rr+usb:///?${new URLSearchParams({ [key]: who, service }).toString()}`;
}

async function describe(node: UsbNode): Promise<Device> {
  const device: Device = {
    name: MARK + (node.url === undefined ? node.device.replace(/^USB device /, "") : node.nodeName || node.nodeId),
    url: node.url ?? "rr+usb:",
    found: false,
    nodeId: node.nodeId,
    nodeName: node.nodeName,
    state: "offline",
    lastError: node.error?.message ?? null,
    services: [],
    mode: null,
    clients: null,
    safe: [],
  };
  if (node.url === undefined) return device;
  try {
    return { ...device, services: await servicesOf(node.url), state: "online" };
  } catch (error) {
    return { ...device, lastError: (error as Error).message };
  }
}

async function servicesOf(url: string): Promise<Service[]> {
  const index = await connect(`${url}&service=${INDEX}`, { timeout: 5_000 });
  try {
    const found = (await index.$.member("GetLocalNodeServices")()) as unknown as Map<
      number,
      { Name: string; RootObjectType: string }
    >;
    return [...found.values()]
      .filter(({ Name }) => Name !== INDEX)
      .map(({ Name, RootObjectType }) => ({ name: Name, type: RootObjectType }));
  } finally {
    void index.$.close();
  }
}

function usbOfBrowser(): (EventTarget & { getDevices(): Promise<unknown[]> }) | undefined {
  return (navigator as { usb?: ReturnType<typeof usbOfBrowser> }).usb;
}
