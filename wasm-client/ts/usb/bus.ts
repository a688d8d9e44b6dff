// One USB device as the core sees it: requests that are carried out, and how they ended. Layer: wasm-client/ts.
// Source: hardware spec sections 3.1 to 3.4; https://wicg.github.io/webusb/. A page may cancel nothing but by closing.
import { make_error, text_of } from "../errors.js";
import type { RobotRaconteurError } from "../errors.js";
import type { UsbControl, UsbStatus } from "./usb_module.js";
import type { WebUsb, WebUsbConfiguration, WebUsbDevice, WebUsbInResult, WebUsbOutResult } from "./webusb.js";

const control_timeout_ms = 5000;
const busy_pause_ms = 100;
const busy_attempts = 20;
/** Some systems let transfers fail a little before they say that the device is gone. */
const gone_grace_ms = 300;

/** By the DOMExceptions of WebUSB. */
const status_names: Record<string, UsbStatus> = {
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
export function name_of(device: WebUsbDevice): string {
  const hex = (number: number) => number.toString(16).padStart(4, "0");
  const product = device.productName ? `"${device.productName.slice(0, 64)}" ` : "";
  return `USB device ${product}(${hex(device.vendorId)}:${hex(device.productId)})`;
}

export class UsbBus {
  readonly name: string;
  /** Resolves when the device is unplugged. */
  readonly gone: Promise<void>;
  #is_gone = false;
  #was_open = false;
  #claimed: number | undefined;
  /** The last one that was not "ok": what there is to advise. */
  #failure: UsbStatus = "ok";
  #stop_listening!: () => void;

  constructor(
    usb: WebUsb,
    private readonly device: WebUsbDevice,
  ) {
    this.name = name_of(device);
    this.gone = new Promise((resolve) => {
      const heard = (event: Event & { device?: unknown }) => {
        if (event.device !== device) return;
        this.#is_gone = true;
        resolve();
      };
      usb.addEventListener("disconnect", heard);
      this.#stop_listening = () => usb.removeEventListener("disconnect", heard);
    });
  }

  /** With its first configuration. @throws RobotRaconteurError ConnectionError */
  async open(): Promise<WebUsbConfiguration> {
    const [configuration] = this.device.configurations;
    if (!configuration) throw this.error("has no configuration");
    this.#was_open = this.device.opened;
    try {
      if (!this.#was_open) await this.device.open();
      if (this.device.configuration?.configurationValue !== configuration.configurationValue) {
        await this.device.selectConfiguration(configuration.configurationValue);
      }
    } catch (error) {
      this.#failure = status_names[name_of_error(error)] ?? "failed";
      throw this.error(`could not be opened: ${text_of(error)}`);
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
      timer = setTimeout(() => reject(new DOMException("no answer", "TimeoutError")), control_timeout_ms);
    });
    const asked = () =>
      typeof data === "number" ? this.device.controlTransferIn(setup, data) : this.device.controlTransferOut(setup, data);
    const outcome = await this.#carry_out(() => Promise.race([asked(), late]));
    clearTimeout(timer);
    return outcome;
  }

  read(endpoint: number, size: number): Promise<UsbOutcome> {
    return this.#carry_out(() => this.device.transferIn(endpoint, size));
  }

  write(endpoint: number, bytes: Uint8Array<ArrayBuffer>): Promise<UsbOutcome> {
    return this.#carry_out(() => this.device.transferOut(endpoint, bytes));
  }

  /** Ends what is still under way. */
  async release(): Promise<void> {
    this.#stop_listening();
    // Neither can be done for a device that is gone, and nothing depends on it.
    if (this.#claimed !== undefined) await this.device.releaseInterface(this.#claimed).catch(() => undefined);
    if (!this.#was_open && this.device.opened) await this.device.close().catch(() => undefined);
  }

  /** `what`: as the core says it; what can be done is added. */
  text(what: string): string {
    const help = advice[this.#is_gone ? "no_device" : this.#failure];
    return `${this.name}: ${what.replace(/^USB (device: )?/, "")}${help ? `; ${help}` : ""}`;
  }

  error(what: string): RobotRaconteurError {
    return make_error("ConnectionError", this.text(what));
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
        const status = this.#is_gone ? "no_device" : (status_names[name_of_error(error)] ?? "busy");
        if (status !== "busy" || attempt === busy_attempts) return (this.#failure = status);
        await pause(busy_pause_ms);
      }
    }
  }

  async #carry_out(transfer: () => Promise<WebUsbInResult | WebUsbOutResult>): Promise<UsbOutcome> {
    let status: UsbStatus;
    let data = new Uint8Array(0);
    let size = 0;
    try {
      const result = await transfer();
      status = result.status === "babble" ? "overflow" : (result.status ?? "ok");
      if ("bytesWritten" in result) size = result.bytesWritten;
      else if (result.data) data = new Uint8Array(result.data.buffer as ArrayBuffer, result.data.byteOffset, result.data.byteLength);
    } catch (error) {
      status = status_names[name_of_error(error)] ?? "failed";
      if (status === "failed") await Promise.race([this.gone, pause(gone_grace_ms)]);
    }
    if (status !== "ok") this.#failure = status = this.#is_gone ? "no_device" : status;
    return { status, data, size };
  }
}

const name_of_error = (error: unknown): string => (error as { name?: string } | undefined)?.name ?? "";

const pause = (milliseconds: number) => new Promise<void>((resolve) => void setTimeout(resolve, milliseconds));
