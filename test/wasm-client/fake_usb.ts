// A navigator.usb with devices that are not there: WebUSB's rules and errors as Chromium has them, the simulated device of
// test/core/hardware (usb_device/test_usb_device.cpp) behind them. Runs in Node and in pages.
import { JsValues } from "../../wasm-client/dist/internal.js";
import type { CoreExports, Handle } from "../../wasm-client/dist/internal.js";
import type {
  WebUsb,
  WebUsbConfiguration,
  WebUsbDevice,
  WebUsbInResult,
  WebUsbOutResult,
  WebUsbSetup,
} from "../../wasm-client/dist/usb/webusb.js";
import type { OpenTransport, Transport } from "../../wasm-client/dist/index.js";

/* eslint-disable @typescript-eslint/naming-convention -- names of C++ */
interface WasmDevice extends CoreExports {
  _initialize(): void;
  buffer(size: number): number;
  address(): number;
  start(
    name: Handle,
    id: number,
    number: number,
    code: number,
    packet: number,
    streams: number,
    class_code: number,
  ): void;
  configuration(): number;
  control(type: number, request: number, value: number, index: number, length: number): number;
  bulk_out(): number;
  bulk_in(): number;
  take_opened(): number;
  take_closed(): number;
  take_input(stream: number): number;
  send(stream: number): void;
  close(stream: number): void;
  notify(stream: number, code: number): void;
  stream_count(): number;
  stall_next_in(): void;
  stall_next_out(): void;
  stall_control(request: number): void;
  unplug(): void;
  send_raw(): void;
  replace_block(): void;
  replace_bos(): void;
  replace_string(index: number): void;
  answer_connect(): void;
  answer_reset(): void;
}
/* eslint-enable @typescript-eslint/naming-convention */

const nak = -100;
const stalled = -2;

export interface FakeDeviceOptions {
  name?: string;
  /** Of the NodeID 10203040-5060-7080-90a0-b0c0d0e0f001. */
  lastIdByte?: number;
  interface?: number;
  vendorCode?: number;
  packetSize?: number;
  maxStreams?: number;
  classCode?: number;
  productName?: string;
  /** No configuration is selected when the device is plugged in. */
  isConfigured?: boolean;
}

const types = { standard: 0, class: 1, vendor: 2 };
const recipients = { device: 0, interface: 1, endpoint: 2, other: 3 };

interface Waiting<Result> {
  resolve(result: Result): void;
  reject(reason: unknown): void;
}

export class FakeUsbDevice implements WebUsbDevice {
  readonly usbVersionMajor: number = 2;
  readonly usbVersionMinor: number = 1;
  readonly usbVersionSubminor: number = 0;
  readonly deviceClass: number = 0;
  readonly vendorId = 0x1209;
  readonly productId = 0x5252;
  readonly productName: string;
  readonly configurations: WebUsbConfiguration[];
  configuration: WebUsbConfiguration | null;
  opened = false;

  /** Whether another program has the interface; whether the system keeps this one from the device. */
  isBusy = false;
  isDenied = false;
  /** A request that is never answered. */
  muteRequest: number | undefined;
  stalledVendorRequest: number | undefined;
  /** The application does not take what it is sent. */
  isDeaf = false;
  /** A browser that hands out more than was asked for. */
  isUnbounded = false;
  /** What the host did, in its order: "open", "claim 0", "c1 03 0000 0000 4", "out 64", ... */
  readonly log: string[] = [];

  #claimed = new Set<number>();
  #isGone = false;
  #running = false;
  readonly #reads: (Waiting<WebUsbInResult> & { length: number })[] = [];
  readonly #writes: (Waiting<WebUsbOutResult> & { bytes: Uint8Array })[] = [];
  readonly #controls = new Set<Waiting<unknown>>();
  readonly #streams = new Map<number, Transport | Uint8Array[]>();

  static async make(code: WebAssembly.Module, options: FakeDeviceOptions = {}): Promise<FakeUsbDevice> {
    const values = new JsValues();
    const { exports } = await WebAssembly.instantiate(code, values.imports);
    const device = exports as unknown as WasmDevice;
    values.attach(device);
    device._initialize();
    const {
      name = "test.service",
      lastIdByte = 1,
      vendorCode = 0xba,
      packetSize = 64,
      maxStreams = 16,
      classCode = 255,
    } = options;
    device.start(values.give(name), lastIdByte, options.interface ?? 0, vendorCode, packetSize, maxStreams, classCode);
    return new FakeUsbDevice(values, device, options);
  }

  private constructor(
    private readonly values: JsValues,
    private readonly device: WasmDevice,
    options: FakeDeviceOptions,
  ) {
    this.productName = options.productName ?? "Test robot";
    this.configurations = [parseConfiguration(this.#bytes(device.configuration()))];
    this.configuration = options.isConfigured === false ? null : this.configurations[0]!;
  }

  // --- WebUSB ---

  async open(): Promise<void> {
    this.#checkPlugged();
    if (this.isDenied) throw new DOMException("Access denied.", "SecurityError");
    this.log.push("open");
    this.opened = true;
  }

  async close(): Promise<void> {
    if (!this.opened) return;
    this.log.push("close");
    this.#claimed.clear();
    this.opened = false;
    this.#abort("AbortError", "The device was closed.");
  }

  async selectConfiguration(value: number): Promise<void> {
    this.#checkOpen();
    this.log.push(`select ${value}`);
    this.configuration = this.configurations.find(({ configurationValue }) => configurationValue === value) ?? null;
  }

  async claimInterface(number: number): Promise<void> {
    this.#checkOpen();
    if (!this.configuration)
      throw new DOMException("The device must have a configuration selected.", "InvalidStateError");
    if (!this.configuration.interfaces.some(({ interfaceNumber }) => interfaceNumber === number)) {
      throw new DOMException("The interface number provided is not supported by the device.", "NotFoundError");
    }
    if (this.isBusy) throw new DOMException("Unable to claim interface.", "NetworkError");
    this.log.push(`claim ${number}`);
    this.#claimed.add(number);
  }

  async releaseInterface(number: number): Promise<void> {
    this.#checkOpen();
    if (!this.#claimed.delete(number)) throw new DOMException("The interface is not claimed.", "InvalidStateError");
    this.log.push(`release ${number}`);
    this.#abort("AbortError", "The transfer was cancelled.");
  }

  async controlTransferIn(setup: WebUsbSetup, length: number): Promise<WebUsbInResult> {
    const answer = await this.#control(0x80, setup, length);
    return answer ? { status: "ok", data: new DataView(answer.buffer) } : { status: "stall" };
  }

  async controlTransferOut(setup: WebUsbSetup, data: BufferSource = new Uint8Array(0)): Promise<WebUsbOutResult> {
    const bytes = data as Uint8Array;
    const answer = await this.#control(0, setup, bytes.length, bytes);
    return answer ? { status: "ok", bytesWritten: bytes.length } : { status: "stall", bytesWritten: 0 };
  }

  transferIn(endpoint: number, length: number): Promise<WebUsbInResult> {
    return new Promise((resolve, reject) => {
      this.#checkEndpoint(endpoint, "in");
      this.#reads.push({ resolve, reject, length });
      this.#run();
    });
  }

  transferOut(endpoint: number, data: BufferSource): Promise<WebUsbOutResult> {
    return new Promise((resolve, reject) => {
      this.#checkEndpoint(endpoint, "out");
      this.#writes.push({ resolve, reject, bytes: (data as Uint8Array).slice() });
      this.#run();
    });
  }

  /** @returns what came in; undefined for a stall. */
  async #control(
    direction: number,
    setup: WebUsbSetup,
    length: number,
    data?: Uint8Array,
  ): Promise<Uint8Array<ArrayBuffer> | undefined> {
    this.#checkOpen();
    if (!this.configuration)
      throw new DOMException("The device must have a configuration selected.", "InvalidStateError");
    if (setup.recipient === "interface" && !this.#claimed.has(setup.index & 0xff)) {
      throw new DOMException("The specified interface has not been claimed.", "InvalidStateError");
    }
    await new Promise<unknown>((resolve, reject) => {
      const waiting = { resolve, reject };
      this.#controls.add(waiting);
      if (setup.request !== this.muteRequest)
        queueMicrotask(() => this.#controls.delete(waiting) && resolve(undefined));
    });
    const type = direction | (types[setup.requestType] << 5) | recipients[setup.recipient];
    const hex = (value: number, digits: number) => value.toString(16).padStart(digits, "0");
    const payload = data ? `: ${[...data].map((byte) => hex(byte, 2)).join(" ")}` : "";
    this.log.push(
      `${hex(type, 2)} ${hex(setup.request, 2)} ${hex(setup.value, 4)} ${hex(setup.index, 4)} ${length}${payload}`,
    );
    if (setup.requestType === "vendor" && setup.request === this.stalledVendorRequest) return undefined;
    if (data) this.#put(data);
    const size = this.device.control(type, setup.request, setup.value, setup.index, length);
    if (size < 0 && size !== stalled) throw new DOMException("The device was disconnected.", "NotFoundError");
    this.#run();
    return size < 0 ? undefined : this.#bytes(size);
  }

  #checkPlugged(): void {
    if (this.#isGone) throw new DOMException("The device was disconnected.", "NotFoundError");
  }

  #checkOpen(): void {
    this.#checkPlugged();
    if (!this.opened) throw new DOMException("The device must be opened first.", "InvalidStateError");
  }

  #checkEndpoint(number: number, direction: "in" | "out"): void {
    this.#checkOpen();
    const isThere = this.configuration?.interfaces.some(
      ({ interfaceNumber, alternates }) =>
        this.#claimed.has(interfaceNumber) &&
        alternates[0]?.endpoints.some((one) => one.endpointNumber === number && one.direction === direction),
    );
    if (!isThere) {
      throw new DOMException(
        "The specified endpoint is not part of a claimed and selected alternate interface.",
        "NotFoundError",
      );
    }
  }

  #abort(name: string, message: string): void {
    const waiting = [...this.#reads.splice(0), ...this.#writes.splice(0), ...this.#controls];
    this.#controls.clear();
    for (const { reject } of waiting) reject(new DOMException(message, name));
  }

  // --- the application of the device ---

  /** Each stream becomes a connection of its own; without it, streams are silent. */
  accept: (() => OpenTransport) | undefined;

  get streamCount(): number {
    return this.device.stream_count();
  }

  send(stream: number, bytes: Uint8Array): void {
    this.#put(bytes);
    this.device.send(stream);
    this.#run();
  }

  closeStream(stream: number): void {
    this.device.close(stream);
    this.#run();
  }

  notify(stream: number, code: number): void {
    this.device.notify(stream, code);
    this.#run();
  }

  /** After the application was deaf. */
  hear(): void {
    this.isDeaf = false;
    this.#run();
  }

  // --- faults ---

  stallNextIn(): void {
    this.device.stall_next_in();
    this.#run();
  }
  stallNextOut(): void {
    this.device.stall_next_out();
  }
  stallControl(request: number): void {
    this.device.stall_control(request);
  }
  sendRaw(transfer: number[]): void {
    this.#put(Uint8Array.from(transfer));
    this.device.send_raw();
    this.#run();
  }
  replaceBos(bytes: number[]): void {
    this.#put(Uint8Array.from(bytes));
    this.device.replace_bos();
  }
  replaceBlock(bytes: number[]): void {
    this.#put(Uint8Array.from(bytes));
    this.device.replace_block();
  }
  replaceString(index: number, bytes: number[]): void {
    this.#put(Uint8Array.from(bytes));
    this.device.replace_string(index);
  }
  answerConnect(bytes: number[]): void {
    this.#put(Uint8Array.from(bytes));
    this.device.answer_connect();
  }
  answerReset(bytes: number[]): void {
    this.#put(Uint8Array.from(bytes));
    this.device.answer_reset();
  }

  /** `name`: how pending transfers fail. */
  unplug(name: "NotFoundError" | "NetworkError"): void {
    this.device.unplug();
    this.#isGone = true;
    this.opened = false;
    this.#abort(name, name === "NetworkError" ? "A transfer error has occurred." : "The device was disconnected.");
  }

  // --- the bus ---

  #bytes(size: number): Uint8Array<ArrayBuffer> {
    const at = this.device.address();
    return this.values.bytes.slice(at, at + size);
  }

  #put(bytes: Uint8Array): void {
    const at = this.device.buffer(bytes.length);
    this.values.bytes.set(bytes, at);
  }

  #numbers(size: number): Int32Array {
    return new Int32Array(this.#bytes(size).buffer);
  }

  /** Until nothing moves any more; soon, as a bus would. */
  #run(): void {
    if (this.#running) return;
    this.#running = true;
    queueMicrotask(() => {
      this.#running = false;
      while (!this.#isGone && this.#step());
    });
  }

  #step(): boolean {
    let hasMoved = false;
    for (let write = this.#writes[0]; write; write = this.#writes[0]) {
      this.#put(write.bytes);
      const size = this.device.bulk_out();
      if (size === nak) break;
      this.log.push(`out ${write.bytes.length}`);
      this.#writes.shift();
      write.resolve(size < 0 ? { status: "stall", bytesWritten: 0 } : { status: "ok", bytesWritten: size });
      hasMoved = true;
    }
    for (const id of this.#numbers(this.device.take_closed())) this.#drop(id);
    for (const id of this.#numbers(this.device.take_opened())) this.#serve(id);
    for (const [id, to] of this.#streams) {
      if (this.isDeaf) break;
      const bytes = this.#bytes(this.device.take_input(id));
      if (bytes.length === 0) continue;
      if (Array.isArray(to)) to.push(bytes);
      else to.send(bytes);
      hasMoved = true;
    }
    for (let read = this.#reads[0]; read; read = this.#reads[0]) {
      const size = this.device.bulk_in();
      if (size === nak) break;
      this.#reads.shift();
      const data = new DataView(this.#bytes(Math.max(size, 0)).buffer);
      if (size < 0) read.resolve({ status: "stall" });
      else if (size > read.length && !this.isUnbounded) read.resolve({ status: "babble" });
      else read.resolve({ status: "ok", data });
      hasMoved = true;
    }
    return hasMoved;
  }

  #serve(id: number): void {
    const early: Uint8Array[] = [];
    this.#streams.set(id, early);
    const open = this.accept?.();
    if (!open) return;
    const listener = {
      opened: () => undefined,
      received: (bytes: Uint8Array) => this.#streams.has(id) && this.send(id, bytes),
      closed: () => this.closeStream(id),
    };
    void Promise.resolve(open(new URL("ws://device.example/"), listener)).then((transport) => {
      if (!this.#streams.has(id)) return transport.close();
      this.#streams.set(id, transport);
      for (const bytes of early) transport.send(bytes);
      this.#run();
    });
  }

  #drop(id: number): void {
    const to = this.#streams.get(id);
    this.#streams.delete(id);
    if (to && !Array.isArray(to)) to.close();
  }
}

export class FakeUsb extends EventTarget implements WebUsb {
  readonly devices: FakeUsbDevice[] = [];
  /** What the user chooses. */
  choice: FakeUsbDevice | DOMException = new DOMException("No device selected.", "NotFoundError");
  readonly asked: unknown[] = [];
  isForbidden = false;

  async getDevices(): Promise<FakeUsbDevice[]> {
    if (this.isForbidden)
      throw new DOMException('Access to the feature "usb" is disallowed by permissions policy.', "SecurityError");
    return [...this.devices];
  }

  requestDevice?: WebUsb["requestDevice"] = async (options) => {
    this.asked.push(options);
    if (this.choice instanceof DOMException) throw this.choice;
    this.devices.push(this.choice);
    return this.choice;
  };

  plug(...devices: FakeUsbDevice[]): void {
    this.devices.push(...devices);
  }

  unplug(device: FakeUsbDevice): void {
    device.unplug("NotFoundError");
    this.tellGone(device);
  }

  tellGone(device: FakeUsbDevice): void {
    this.devices.splice(this.devices.indexOf(device), 1);
    this.dispatchEvent(Object.assign(new Event("disconnect"), { device }));
  }
}

/** A configuration descriptor (USB 2.0, section 9.6.3) as browsers show it. */
function parseConfiguration(bytes: Uint8Array): WebUsbConfiguration {
  const interfaces: { interfaceNumber: number; alternates: any[] }[] = [];
  for (let at = 0; at < bytes.length; at += bytes[at]!) {
    const field = (offset: number) => bytes[at + offset]!;
    if (field(1) === 4) {
      const alternate = { alternateSetting: field(3), interfaceClass: field(5), endpoints: [] };
      interfaces.push({ interfaceNumber: field(2), alternates: [alternate] });
    } else if (field(1) === 5) {
      interfaces.at(-1)!.alternates[0].endpoints.push({
        endpointNumber: field(2) & 15,
        direction: field(2) & 128 ? "in" : "out",
        type: ["control", "isochronous", "bulk", "interrupt"][field(3) & 3],
        packetSize: field(4) | (field(5) << 8),
      });
    }
  }
  return { configurationValue: bytes[5]!, interfaces };
}
