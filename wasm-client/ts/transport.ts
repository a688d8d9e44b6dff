// A byte stream in both directions, whatever carries it. Layer: wasm-client/ts.
import type { Core, CoreOptions } from "./wasm_module.js";

export interface Transport {
  /** Copies `bytes` before it returns: they lie in memory that changes afterwards. */
  send(bytes: Uint8Array): void;
  /** Bytes taken by send() that are not on their way yet. */
  readonly buffered: number;
  close(): void;
}

/** One that leads to where the protocol is spoken, too: this side needs no core of its own. */
export interface CoreTransport extends Transport {
  /** As Core.create(), for what goes over this transport. */
  createCore(options: CoreOptions): Promise<Core>;
}

/** What a transport tells; nothing before its open function has returned, nothing after closed(). */
export interface TransportListener {
  opened(): void;
  /** Borrowed for the call. */
  received(bytes: Uint8Array): void;
  /** `reason`: a sentence for people. */
  closed(reason: string): void;
}

export type OpenTransport = (url: URL, listener: TransportListener) => Transport | Promise<Transport>;
