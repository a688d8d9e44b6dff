// The compiled USB half of the core: the only file that knows its handles and its memory. Layer: wasm-client/ts.
// Source: src/usb_bindings.cpp, and core/hardware/usb_probe.hpp and usb_link.hpp behind it.
import { JsValues } from "../js_values.js";
import type { CoreExports, Handle } from "../js_values.js";
import { Once } from "../once.js";
import { platform } from "../platform.js";
import type { WebUsbConfiguration, WebUsbSetup } from "./webusb.js";

/** As rr::UsbStatus. */
const statuses = [
  "ok",
  "stall",
  "no_device",
  "timed_out",
  "cancelled",
  "overflow",
  "busy",
  "denied",
  "failed",
] as const;
export type UsbStatus = (typeof statuses)[number];

export interface UsbControl {
  setup: WebUsbSetup;
  /** Bytes asked for, or what the host sends. */
  data: number | Uint8Array<ArrayBuffer>;
}

export interface UsbEvent {
  kind: "opened" | "readable" | "writable" | "closed";
  stream: number;
  /** closed only. */
  reason: string;
}

/* eslint-disable @typescript-eslint/naming-convention -- names of C++ */
interface WasmUsb extends CoreExports {
  _initialize(): void;
  buffer(size: number): number;
  add_interface(number: number, alternate: number, class_code: number): void;
  add_endpoint(address: number, is_bulk: boolean, packet_size: number): void;
  node(): Handle;
  interface_number(): number;
  in_address(): number;
  out_address(): number;
  handle_control(status: number, size: number): void;
  handle_written(slot: number, status: number, size: number): void;
  handle_read(slot: number, status: number, size: number): void;
  open_stream(): number;
  write(stream: number): number;
  read(stream: number): number;
  close_stream(stream: number): void;
  close(reason: Handle): void;
  poll_control(): number;
  poll_write(): number;
  write_address(): number;
  write_size(): number;
  poll_read(): number;
  read_address(): number;
  read_size(): number;
  poll_event(): Handle;
  has_link(): number;
  is_ending(): number;
  is_closed(): number;
  is_sent(stream: number): number;
  unsent_bytes(stream: number): number;
  unread_bytes(stream: number): number;
}
/* eslint-enable @typescript-eslint/naming-convention */

const requestTypes = ["standard", "class", "vendor"] as const;
const recipients = ["device", "interface", "endpoint", "other"] as const;
const inBit = 0x80;
const endpointBits = 0x0f;

const compiled = new Once(
  // Written out so that bundlers see it and ship the file.
  () => platform.loadWasm(new URL("./rrgate-usb.wasm", import.meta.url)),
  "the protocol core for USB could not be loaded",
);

/**
 * One claim of one device, in an instance of its own: first the probe that finds out who it is, then its streams.
 * All methods follow the order of the sans-IO contract: after whatever is told or asked, poll.
 */
export class UsbCore {
  readonly #values: JsValues;
  readonly #usb: WasmUsb;

  /** @throws RobotRaconteurError SystemResourceError: the file cannot be loaded. */
  static async create(configuration: WebUsbConfiguration): Promise<UsbCore> {
    const code = await compiled.get();
    const values = new JsValues();
    const { exports } = await WebAssembly.instantiate(code, values.imports);
    return new UsbCore(values, exports as unknown as WasmUsb, configuration);
  }

  private constructor(values: JsValues, usb: WasmUsb, configuration: WebUsbConfiguration) {
    this.#values = values;
    this.#usb = usb;
    values.attach(usb);
    usb._initialize();
    for (const { interfaceNumber, alternates } of configuration.interfaces) {
      for (const { alternateSetting, interfaceClass, endpoints } of alternates) {
        usb.add_interface(interfaceNumber, alternateSetting, interfaceClass);
        for (const { endpointNumber, direction, type, packetSize } of endpoints) {
          usb.add_endpoint(endpointNumber | (direction === "in" ? inBit : 0), type === "bulk", packetSize);
        }
      }
    }
  }

  // --- who it is ---

  /** While control requests are to be made: undefined. Then the node, or a sentence that says why it is none. */
  node(): { id: string; name: string } | string | undefined {
    return this.#values.take(this.#usb.node()) as { id: string; name: string } | string | undefined;
  }

  /** Of a device whose node is known. */
  places(): { interface: number; in: number; out: number } {
    const usb = this.#usb;
    return {
      interface: usb.interface_number(),
      in: usb.in_address() & endpointBits,
      out: usb.out_address() & endpointBits,
    };
  }

  // --- told ---

  handleControl(status: UsbStatus, data: Uint8Array): void {
    this.#put(data);
    this.#usb.handle_control(statuses.indexOf(status), data.length);
  }

  handleWritten(slot: number, status: UsbStatus, size: number): void {
    this.#usb.handle_written(slot, statuses.indexOf(status), size);
  }

  /** `data`: no more than poll_read() asked for. */
  handleRead(slot: number, address: number, status: UsbStatus, data: Uint8Array): void {
    this.#values.bytes.set(data, address);
    this.#usb.handle_read(slot, statuses.indexOf(status), data.length);
  }

  // --- asked ---

  openStream(): number {
    return this.#usb.open_stream();
  }

  /** Takes all of them. */
  write(stream: number, bytes: Uint8Array): void {
    this.#put(bytes);
    this.#usb.write(stream);
  }

  /** What was received; a copy. */
  read(stream: number): Uint8Array {
    const size = this.#usb.unread_bytes(stream);
    const address = this.#usb.buffer(size);
    this.#usb.read(stream);
    return this.#values.bytes.slice(address, address + size);
  }

  closeStream(stream: number): void {
    this.#usb.close_stream(stream);
  }

  close(reason: string): void {
    this.#usb.close(this.#values.give(reason));
  }

  // --- answers ---

  pollControl(): UsbControl | undefined {
    const at = this.#usb.poll_control();
    if (at === 0) return undefined;
    const view = new DataView(this.#values.bytes.buffer, at);
    const type = view.getUint8(0);
    const length = view.getUint16(6, true);
    return {
      setup: {
        requestType: requestTypes[(type >> 5) & 3] ?? "vendor",
        recipient: recipients[type & 31] ?? "other",
        request: view.getUint8(1),
        value: view.getUint16(2, true),
        index: view.getUint16(4, true),
      },
      data: type & inBit ? length : this.#values.bytes.slice(at + 8, at + 8 + length),
    };
  }

  pollWrite(): { slot: number; bytes: Uint8Array<ArrayBuffer> } | undefined {
    const slot = this.#usb.poll_write();
    if (slot === 0) return undefined;
    const at = this.#usb.write_address();
    return { slot, bytes: this.#values.bytes.slice(at, at + this.#usb.write_size()) };
  }

  pollRead(): { slot: number; address: number; size: number } | undefined {
    const slot = this.#usb.poll_read();
    return slot === 0 ? undefined : { slot, address: this.#usb.read_address(), size: this.#usb.read_size() };
  }

  pollEvent(): UsbEvent | undefined {
    return this.#values.take(this.#usb.poll_event()) as UsbEvent | undefined;
  }

  // --- looked at ---

  /** Whether a stream was ever asked for. */
  hasLink(): boolean {
    return this.#usb.has_link() !== 0;
  }

  /** New streams need a new claim. */
  isEnding(): boolean {
    return this.#usb.is_ending() !== 0;
  }

  isClosed(): boolean {
    return this.#usb.is_closed() !== 0;
  }

  isSent(stream: number): boolean {
    return this.#usb.is_sent(stream) !== 0;
  }

  unsentBytes(stream: number): number {
    return this.#usb.unsent_bytes(stream);
  }

  #put(bytes: Uint8Array): void {
    const address = this.#usb.buffer(bytes.length);
    this.#values.bytes.set(bytes, address);
  }
}
