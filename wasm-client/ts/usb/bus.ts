// One USB device as the core sees it: requests that are carried out, and how they ended. Layer: wasm-client/ts.
// Source: hardware spec sections 3.1 to 3.4; https://wicg.github.io/webusb/. A page may cancel nothing but by closing.
import { makeError, textOf } from "../errors.js";
import type { RobotRaconteurError } from "../errors.js";
import type { UsbControl, UsbStatus } from "./usb_module.js";
import type { WebUsb, WebUsbConfiguration, WebUsbDevice, WebUsbInResult, WebUsbOutResult } from "./webusb.js";

const controlTimeoutMs = 5000;
const busyPauseMs = 100;
const busyAttempts = 20;
/** Some systems let transfers fail a little before they say that the device is gone. */
const goneGraceMs = 300;

/** By the DOMExceptions of WebUSB. */
const statusNames: Record<string, UsbStatus> = {
  NotFoundError: "no_device",
  SecurityError: "denied",
  TimeoutError: "timed_out",
  AbortError: "cancelled",
};

const advice: Partial<Record<UsbStatus, string>> = {
  busy: "close the other program, or the other page of this browser, that has it open",
  denied:
    "on Linux this user needs to read and write the device (60-robotraconteur-usb.rules in /etc/udev/rules.d, then plug it " +
    "in again); on Windows the device needs the driver WinUSB, and no other program may have it open",
  no_device: "plug it in again",
};

export interface UsbOutcome {
  status: UsbStatus;
  /** What came in. */
  data: Uint8Array;
  /** Bytes that went out. */
  size: number;
}

/** 'USB device "Robot" (1209:5252)' */
export function nameOf(device: WebUsbDevice): string {
  const hex = (number: number) => number.toString(16).padStart(4, "0");
  const product = device.productName ? `"${device.productName.slice(0, 64)}" ` : "";
  return `USB device ${product}(${hex(device.vendorId)}:${hex(device.productId)})`;
}

export class UsbBus {
  readonly name: string;
  /** Resolves when the device is unplugged. */
  readonly gone: Promise<void>;
  #isGone = false;
  #wasOpen = false;
  #claimed: number | undefined;
  /** The last one that was not "ok": what there is to advise. */
  #failure: UsbStatus = "ok";
  #stopListening!: () => void;

  constructor(
    usb: WebUsb,
    private readonly device: WebUsbDevice,
  ) {
    this.name = nameOf(device);
    this.gone = new Promise((resolve) => {
      const heard = (event: Event & { device?: unknown }) => {
        if (event.device !== device) return;
        this.#isGone = true;
        resolve();
      };
      usb.addEventListener("disconnect", heard);
      this.#stopListening = () => usb.removeEventListener("disconnect", heard);
    });
  }

  /** With its first configuration. @throws RobotRaconteurError ConnectionError */
  async open(): Promise<WebUsbConfiguration> {
    const [configuration] = this.device.configurations;
    if (!configuration) throw this.error("has no configuration");
    this.#wasOpen = this.device.opened;
    try {
      if (!this.#wasOpen) await this.device.open();
      if (this.device.configuration?.configurationValue !== configuration.configurationValue) {
        await this.device.selectConfiguration(configuration.configurationValue);
      }
    } catch (error) {
      this.#failure = statusNames[nameOfError(error)] ?? "failed";
      throw this.error(`could not be opened: ${textOf(error)}`);
    }
    return configuration;
  }

  async control({ setup, data }: UsbControl): Promise<UsbOutcome> {
    if (setup.recipient === "interface") {
      const status = await this.#claim(setup.index & 0xff);
      if (status !== "ok") return { status, data: new Uint8Array(0), size: 0 };
    }
    let timer: ReturnType<typeof setTimeout> | undefined;
    const late = new Promise<never>((_, reject) => {
      timer = setTimeout(() => reject(new DOMException("no answer", "TimeoutError")), controlTimeoutMs);
    });
    const asked = () =>
      typeof data === "number"
        ? this.device.controlTransferIn(setup, data)
        : this.device.controlTransferOut(setup, data);
    const outcome = await this.#carryOut(() => Promise.race([asked(), late]));
    clearTimeout(timer);
    return outcome;
  }

  read(endpoint: number, size: number): Promise<UsbOutcome> {
    return this.#carryOut(() => this.device.transferIn(endpoint, size));
  }

  write(endpoint: number, bytes: Uint8Array<ArrayBuffer>): Promise<UsbOutcome> {
    return this.#carryOut(() => this.device.transferOut(endpoint, bytes));
  }

  /** Ends what is still under way. */
  async release(): Promise<void> {
    this.#stopListening();
    // Neither can be done for a device that is gone, and nothing depends on it.
    if (this.#claimed !== undefined) await this.device.releaseInterface(this.#claimed).catch(() => undefined);
    if (!this.#wasOpen && this.device.opened) await this.device.close().catch(() => undefined);
  }

  /** `what`: as the core says it; what can be done is added. */
  text(what: string): string {
    const help = advice[this.#isGone ? "no_device" : this.#failure];
    return `${this.name}: ${what.replace(/^USB (device: )?/, "")}${help ? `; ${help}` : ""}`;
  }

  error(what: string): RobotRaconteurError {
    return makeError("ConnectionError", this.text(what));
  }

  /** Requests to an interface need it, and so do its endpoints. The page before may not have let go of it yet. */
  async #claim(number: number): Promise<UsbStatus> {
    if (this.#claimed === number) return "ok";
    for (let attempt = 1; ; ++attempt) {
      try {
        await this.device.claimInterface(number);
        this.#claimed = number;
        return "ok";
      } catch (error) {
        const status = this.#isGone ? "no_device" : (statusNames[nameOfError(error)] ?? "busy");
        if (status !== "busy" || attempt === busyAttempts) return (this.#failure = status);
        await pause(busyPauseMs);
      }
    }
  }

  async #carryOut(transfer: () => Promise<WebUsbInResult | WebUsbOutResult>): Promise<UsbOutcome> {
    let status: UsbStatus;
    let data = new Uint8Array(0);
    let size = 0;
    try {
      const result = await transfer();
      status = result.status === "babble" ? "overflow" : (result.status ?? "ok");
      if ("bytesWritten" in result) size = result.bytesWritten;
      else if (result.data)
        data = new Uint8Array(result.data.buffer as ArrayBuffer, result.data.byteOffset, result.data.byteLength);
    } catch (error) {
      status = statusNames[nameOfError(error)] ?? "failed";
      if (status === "failed") await Promise.race([this.gone, pause(goneGraceMs)]);
    }
    if (status !== "ok") this.#failure = status = this.#isGone ? "no_device" : status;
    return { status, data, size };
  }
}

const nameOfError = (error: unknown): string => (error as { name?: string } | undefined)?.name ?? "";

const pause = (milliseconds: number) => new Promise<void>((resolve) => void setTimeout(resolve, milliseconds));
