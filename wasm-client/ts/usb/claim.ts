// The claim on one USB device, which all its streams share. Layer: wasm-client/ts. Source: hardware spec section 3.
// The protocol itself is core/hardware/usb_link.hpp.
import { textOf } from "../errors.js";
import type { Transport, TransportListener } from "../transport.js";
import { UsbBus } from "./bus.js";
import { UsbCore } from "./usb_module.js";
import type { UsbControl, UsbEvent } from "./usb_module.js";
import type { WebUsb, WebUsbDevice } from "./webusb.js";

/** How long a stream that is closed waits until the device has taken what was sent. */
const lingerMs = 1000;

export interface UsbNodeName {
  /** "82301bf1-e1ef-4e89-8d8f-0848291587ac" */
  id: string;
  /** May be empty. */
  name: string;
}

interface Stream {
  listener: TransportListener;
  isOpen: boolean;
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
  #settleReleased!: () => void;
  #isReleased = false;
  readonly #bus: UsbBus;
  #core!: UsbCore;
  #places!: { interface: number; in: number; out: number };
  readonly #node: Promise<UsbNodeName>;
  #users = 0;
  readonly #streams = new Map<number, Stream>();
  #isPumping = false;
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
        if (!claim.#isEnding) return what(claim, node);
      } finally {
        if (--claim.#users === 0 && claim.#core && !claim.#core.hasLink()) claim.#release();
      }
      await claim.#released;
    }
  }

  private constructor(usb: WebUsb, device: WebUsbDevice) {
    claims.set(device, this);
    this.#released = new Promise((resolve) => (this.#settleReleased = resolve));
    void this.#released.then(() => claims.delete(device));
    this.#bus = new UsbBus(usb, device);
    void this.#bus.gone.then(() => this.#guarded(() => this.#core?.close("USB device: was unplugged")));
    this.#node = this.#identify(device);
    this.#node.catch(() => undefined); // whoever uses the claim hears of it
  }

  /** `listener` is told when the stream is open; all errors are told to it, too. */
  openStream(listener: TransportListener): Transport {
    const core = this.#core;
    const key = core.openStream();
    const stream: Stream = { listener, isOpen: false };
    this.#streams.set(key, stream);
    this.#pump();
    return {
      send: (bytes) => {
        if (this.#streams.get(key) !== stream || stream.timer) return;
        this.#guarded(() => core.write(key, bytes));
      },
      get buffered() {
        return core.unsentBytes(key);
      },
      close: () => {
        if (this.#streams.get(key) !== stream || stream.timer) return;
        if (core.isSent(key)) this.#end(key);
        else stream.timer = setTimeout(() => this.#end(key), lingerMs);
      },
    };
  }

  get #isEnding(): boolean {
    return this.#isReleased || this.#core.isEnding();
  }

  async #identify(device: WebUsbDevice): Promise<UsbNodeName> {
    try {
      const configuration = await this.#bus.open();
      const core = await UsbCore.create(configuration);
      for (let request = core.pollControl(); request; request = core.pollControl()) {
        const { status, data } = await this.#bus.control(request);
        core.handleControl(status, data);
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
    if (this.#isPumping || this.#isReleased || !this.#core.hasLink()) return;
    this.#isPumping = true;
    this.#guarded(() => {
      for (;;) {
        this.#post();
        const event = this.#core.pollEvent();
        if (!event) break;
        this.#handle(event);
      }
    });
    this.#isPumping = false;
    if (!this.#isReleased && this.#core.isClosed()) this.#release();
  }

  #post(): void {
    const core = this.#core;
    const control = core.pollControl();
    if (control) void this.#control(control);
    for (let write = core.pollWrite(); write; write = core.pollWrite()) void this.#write(write.slot, write.bytes);
    for (let read = core.pollRead(); read; read = core.pollRead()) this.#read(read.slot, read.address, read.size);
  }

  async #control(request: UsbControl): Promise<void> {
    const { status, data } = await this.#bus.control(request);
    this.#guarded(() => this.#core.handleControl(status, data));
  }

  async #write(slot: number, bytes: Uint8Array<ArrayBuffer>): Promise<void> {
    const { status, size } = await this.#bus.write(this.#places.out, bytes);
    this.#guarded(() => this.#core.handleWritten(slot, status, size));
  }

  #read(slot: number, address: number, size: number): void {
    const reading = this.#bus.read(this.#places.in, size);
    this.#reads = this.#reads.then(async () => {
      const { status, data } = await reading;
      const fits = data.length <= size;
      this.#guarded(() => this.#core.handleRead(slot, address, fits ? status : "overflow", data.subarray(0, size)));
    });
  }

  #handle({ kind, stream: key, reason }: UsbEvent): void {
    const stream = this.#streams.get(key);
    if (!stream) return;
    const isMute = stream.timer !== undefined;
    switch (kind) {
      case "opened":
        stream.isOpen = true;
        if (!isMute) stream.listener.opened();
        break;
      case "readable": {
        const bytes = this.#core.read(key);
        if (!isMute) stream.listener.received(bytes);
        break;
      }
      case "writable":
        if (isMute && this.#core.isSent(key)) this.#end(key);
        break;
      case "closed":
        this.#end(key);
        if (!isMute) this.#tellClosed(stream, reason);
        break;
    }
  }

  #tellClosed({ listener, isOpen }: Stream, reason: string): void {
    const why = this.#bus.text(reason);
    listener.closed(isOpen ? `the connection was lost: ${why}` : `could not connect: ${why}`);
  }

  /** The core forgets the stream, and tells the device if it does not know. */
  #end(key: number): void {
    clearTimeout(this.#streams.get(key)?.timer);
    this.#streams.delete(key);
    this.#guarded(() => this.#core.closeStream(key));
  }

  /** Does something in the core, then whatever follows. An exception there is a trap (memory at its end). */
  #guarded(what: () => void): void {
    if (this.#isReleased) return;
    try {
      what();
    } catch (error) {
      const streams = [...this.#streams.values()];
      this.#streams.clear();
      this.#release();
      for (const stream of streams) this.#tellClosed(stream, `failed: ${textOf(error)}`);
      return;
    }
    if (this.#core) this.#pump();
  }

  #release(): void {
    if (this.#isReleased) return;
    this.#isReleased = true;
    void this.#bus.release().then(this.#settleReleased);
  }
}
