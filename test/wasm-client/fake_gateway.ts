// A gateway for a page that is a device, without network: it takes the page's sockets and hands them to clients.
import { connect, type OpenTransport } from "../../wasm-client/dist/node.js";
import { platform } from "../../wasm-client/dist/internal.js";

type Listener = (bytes: Uint8Array) => void;

/** The page's end of a WebSocket. */
export class PageSocket extends EventTarget {
  binaryType = "blob";
  bufferedAmount = 0;
  /** Bytes that the page has sent. */
  received: Listener = () => undefined;
  ended: () => void = () => undefined;
  isClosed = false;

  constructor(
    readonly url: string,
    readonly protocols: string[],
  ) {
    super();
    queueMicrotask(() => this.dispatchEvent(new Event("open")));
  }

  send(data: Uint8Array): void {
    this.received(data.slice());
  }

  close(): void {
    if (this.isClosed) return;
    this.isClosed = true;
    this.ended();
  }

  /** To the page. */
  tell(data: string | ArrayBuffer): void {
    if (!this.isClosed) this.dispatchEvent(new MessageEvent("message", { data }));
  }

  end(code: number, reason: string): void {
    this.isClosed = true;
    this.dispatchEvent(Object.assign(new Event("close"), { code, reason }));
  }
}

export class FakeGateway {
  /** Those by which the page is told, the last one now. */
  readonly controls: PageSocket[] = [];
  readonly #wanted = new Map<string, (socket: PageSocket) => void>();
  /** What it answers a page that comes. */
  answer = (control: PageSocket): void => control.tell(JSON.stringify({ served: "phone" }));

  constructor() {
    const gateway = this;
    platform.findWebsocket = () =>
      Promise.resolve(
        class extends PageSocket {
          constructor(url: string, protocols: string[]) {
            super(url, protocols);
            gateway.#take(this);
          }
        } as unknown as typeof WebSocket,
      );
  }

  #take(socket: PageSocket): void {
    const key = new URL(socket.url).searchParams.get("key");
    if (key !== null) return this.#wanted.get(key)?.(socket);
    this.controls.push(socket);
    setTimeout(() => this.answer(socket));
  }

  get control(): PageSocket {
    return this.controls.at(-1)!;
  }

  /** A connection that the page opens. */
  open(): Promise<PageSocket> {
    const key = String(this.#wanted.size);
    const opened = new Promise<PageSocket>((resolve) => this.#wanted.set(key, resolve));
    this.control.tell(JSON.stringify({ open: key }));
    return opened;
  }

  /** A client of the page; `made` hears of the page's socket. */
  connect<T>(made: (socket: PageSocket) => void = () => undefined) {
    const transport: OpenTransport = async (_, listener) => {
      const socket = await this.open();
      made(socket);
      // The page's own: each frame takes a turn of the event loop.
      socket.received = (bytes) => void setTimeout(() => listener.received(bytes));
      socket.ended = () => void setTimeout(() => listener.closed("the page has closed it"));
      setTimeout(() => listener.opened());
      return {
        send: (bytes) => {
          const copy = bytes.slice().buffer;
          setTimeout(() => socket.tell(copy));
        },
        buffered: 0,
        close: () => void setTimeout(() => socket.end(1000, "")),
      };
    };
    return connect<T>("ws://gateway/devices/phone?service=Phone", { transport });
  }
}
