// The claim on one USB device, which all its streams share. Layer: wasm-client/ts. Source: hardware spec section 3.
// The protocol itself is core/hardware/usb_link.hpp.
import { text_of } from "../errors.js";
import type { Transport, TransportListener } from "../transport.js";
import { UsbBus } from "./bus.js";
import { UsbCore } from "./usb_module.js";
import type { UsbControl, UsbEvent } from "./usb_module.js";
import type { WebUsb, WebUsbDevice } from "./webusb.js";

/** How long a stream that is closed waits until the device has taken what was sent. */
const linger_ms = 1000;

export interface UsbNodeName {
  /** "82301bf1-e1ef-4e89-8d8f-0848291587ac" */
  id: string;
  /** May be empty. */
  name: string;
}

interface Stream {
  listener: TransportListener;
  is_open: boolean;
  /** Since close(), while it lingers. */
  timer?: ReturnType<typeof setTimeout>;
}

const claims = new Map<WebUsbDevice, UsbClaim>();
/** Who the devices are that were asked; a device that is plugged in again is another object. */
const nodes = new WeakMap<WebUsbDevice, UsbNodeName>();

/** Opens and claims the device at once, and gives it back when its last stream has been closed, or its last user leaves. */
export class UsbClaim {
  /** Resolves when the device can be claimed anew. */
  readonly #released: Promise<void>;
  #settle_released!: () => void;
  #is_released = false;
  readonly #bus: UsbBus;
  #core!: UsbCore;
  #places!: { interface: number; in: number; out: number };
  readonly #node: Promise<UsbNodeName>;
  #users = 0;
  readonly #streams = new Map<number, Stream>();
  #is_pumping = false;
  /** Transfers end in the order in which they were begun, also where one has to find out why it failed. */
  #reads: Promise<void> = Promise.resolve();

  /** Who the device is, if that is known already. */
  static known(device: WebUsbDevice): UsbNodeName | undefined {
    return nodes.get(device);
  }

  /**
   * Calls `what` with the claim on the device, as soon as it is known who it is.
   * @throws RobotRaconteurError ConnectionError: the device cannot be claimed, or is no node; what `what` throws.
   */
  static async use<T>(usb: WebUsb, device: WebUsbDevice, what: (claim: UsbClaim, node: UsbNodeName) => T): Promise<T> {
    for (;;) {
      const claim = claims.get(device) ?? new UsbClaim(usb, device);
      ++claim.#users;
      try {
        const node = await claim.#node;
        if (!claim.#is_ending) return what(claim, node);
      } finally {
        if (--claim.#users === 0 && claim.#core && !claim.#core.has_link()) claim.#release();
      }
      await claim.#released;
    }
  }

  private constructor(usb: WebUsb, device: WebUsbDevice) {
    claims.set(device, this);
    this.#released = new Promise((resolve) => (this.#settle_released = resolve));
    void this.#released.then(() => claims.delete(device));
    this.#bus = new UsbBus(usb, device);
    void this.#bus.gone.then(() => this.#guarded(() => this.#core?.close("USB device: was unplugged")));
    this.#node = this.#identify(device);
    this.#node.catch(() => undefined); // whoever uses the claim hears of it
  }

  /** `listener` is told when the stream is open; all errors are told to it, too. */
  open_stream(listener: TransportListener): Transport {
    const core = this.#core;
    const key = core.open_stream();
    const stream: Stream = { listener, is_open: false };
    this.#streams.set(key, stream);
    this.#pump();
    return {
      send: (bytes) => {
        if (this.#streams.get(key) !== stream || stream.timer) return;
        this.#guarded(() => core.write(key, bytes));
      },
      get buffered() {
        return core.unsent_bytes(key);
      },
      close: () => {
        if (this.#streams.get(key) !== stream || stream.timer) return;
        if (core.is_sent(key)) this.#end(key);
        else stream.timer = setTimeout(() => this.#end(key), linger_ms);
      },
    };
  }

  get #is_ending(): boolean {
    return this.#is_released || this.#core.is_ending();
  }

  async #identify(device: WebUsbDevice): Promise<UsbNodeName> {
    try {
      const configuration = await this.#bus.open();
      const core = await UsbCore.create(configuration);
      for (let request = core.poll_control(); request; request = core.poll_control()) {
        const { status, data } = await this.#bus.control(request);
        core.handle_control(status, data);
      }
      const node = core.node();
      if (typeof node !== "object") throw this.#bus.error(node ?? "did not answer");
      this.#places = core.places();
      this.#core = core;
      nodes.set(device, node);
      return node;
    } catch (error) {
      this.#release();
      throw error;
    }
  }

  // --- the pump: after whatever was told or asked, poll until nothing is left ---

  #pump(): void {
    // While it runs, a listener asked something: the loop below goes on with it.
    if (this.#is_pumping || this.#is_released || !this.#core.has_link()) return;
    this.#is_pumping = true;
    this.#guarded(() => {
      for (;;) {
        this.#post();
        const event = this.#core.poll_event();
        if (!event) break;
        this.#handle(event);
      }
    });
    this.#is_pumping = false;
    if (!this.#is_released && this.#core.is_closed()) this.#release();
  }

  #post(): void {
    const core = this.#core;
    const control = core.poll_control();
    if (control) void this.#control(control);
    for (let write = core.poll_write(); write; write = core.poll_write()) void this.#write(write.slot, write.bytes);
    for (let read = core.poll_read(); read; read = core.poll_read()) this.#read(read.slot, read.address, read.size);
  }

  async #control(request: UsbControl): Promise<void> {
    const { status, data } = await this.#bus.control(request);
    this.#guarded(() => this.#core.handle_control(status, data));
  }

  async #write(slot: number, bytes: Uint8Array<ArrayBuffer>): Promise<void> {
    const { status, size } = await this.#bus.write(this.#places.out, bytes);
    this.#guarded(() => this.#core.handle_written(slot, status, size));
  }

  #read(slot: number, address: number, size: number): void {
    const reading = this.#bus.read(this.#places.in, size);
    this.#reads = this.#reads.then(async () => {
      const { status, data } = await reading;
      const fits = data.length <= size;
      this.#guarded(() => this.#core.handle_read(slot, address, fits ? status : "overflow", data.subarray(0, size)));
    });
  }

  #handle({ kind, stream: key, reason }: UsbEvent): void {
    const stream = this.#streams.get(key);
    if (!stream) return;
    const is_mute = stream.timer !== undefined;
    switch (kind) {
      case "opened":
        stream.is_open = true;
        if (!is_mute) stream.listener.opened();
        break;
      case "readable": {
        const bytes = this.#core.read(key);
        if (!is_mute) stream.listener.received(bytes);
        break;
      }
      case "writable":
        if (is_mute && this.#core.is_sent(key)) this.#end(key);
        break;
      case "closed":
        this.#end(key);
        if (!is_mute) this.#tell_closed(stream, reason);
        break;
    }
  }

  #tell_closed({ listener, is_open }: Stream, reason: string): void {
    const why = this.#bus.text(reason);
    listener.closed(is_open ? `the connection was lost: ${why}` : `could not connect: ${why}`);
  }

  /** The core forgets the stream, and tells the device if it does not know. */
  #end(key: number): void {
    clearTimeout(this.#streams.get(key)?.timer);
    this.#streams.delete(key);
    this.#guarded(() => this.#core.close_stream(key));
  }

  /** Does something in the core, then whatever follows. An exception there is a trap (memory at its end). */
  #guarded(what: () => void): void {
    if (this.#is_released) return;
    try {
      what();
    } catch (error) {
      const streams = [...this.#streams.values()];
      this.#streams.clear();
      this.#release();
      for (const stream of streams) this.#tell_closed(stream, `failed: ${text_of(error)}`);
      return;
    }
    if (this.#core) this.#pump();
  }

  #release(): void {
    if (this.#is_released) return;
    this.#is_released = true;
    void this.#bus.release().then(this.#settle_released);
  }
}
