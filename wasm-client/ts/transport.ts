// A byte stream in both directions, whatever carries it. Layer: wasm-client/ts.

export interface Transport {
  /** Copies `bytes` before it returns: they lie in memory that changes afterwards. */
  send(bytes: Uint8Array): void;
  /** Bytes taken by send() that are not on their way yet. */
  readonly buffered: number;
  close(): void;
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
