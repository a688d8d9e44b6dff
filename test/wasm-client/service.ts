// A service in the same process: the core's service side as WebAssembly (service/test_service.cpp), behind a transport
// that keeps what went over it. It works with any definition:
//   properties, wires        keep what they are given, and give it back; wires send it when they are connected
//   functions                return their first argument; these do something besides:
//     fire_EVENT(...)        fires EVENT with the same arguments
//     publish_WIRE(value)    sends the InValue of WIRE
//     release(path)          releases an object
//     fail(name, text)       raises the exception `name` with sub name "detail" and the parameter int32[] 1, 2
//     hang(), stop()         never answers; closes the service
//   objrefs                  of every index but "missing" and 99; a property `name` tells which
// Service "test", node "test.service", attribute site = "dock".
import { readFileSync } from "node:fs";
import { connect } from "../../wasm-client/dist/index.js";
import type { ConnectOptions, OpenTransport, RemoteObject, TransportListener } from "../../wasm-client/dist/index.js";

interface WasmService {
  error(): string;
  set_now(steady: number): void;
  receive_buffer(size: number): number;
  handle_bytes(): void;
  release(path: string): void;
  stop(): void;
  wants_close(): boolean;
  poll_transmit(): Uint8Array | undefined;
  handle_transmitted(size: number): void;
}
interface WasmModule {
  HEAPU8: Uint8Array;
  Service: new (options: object, steady: number) => WasmService;
}

const built = new URL("../../build/wasm/test/wasm-client/service/", import.meta.url);

export interface ServiceOptions {
  definitions: string[];
  root: string;
  version?: 2 | 4;
  stringTable?: boolean;
  /** The service's bytes arrive in pieces of this size. */
  pieces?: number;
}

export class TestService {
  /** What the client sent, one item a frame. */
  readonly sent: Uint8Array[] = [];
  /** Bytes that the transport says it holds back. */
  buffered = 0;
  /** What the client sends gets lost. */
  is_mute = false;
  /** Whether the client has closed the transport. */
  is_closed = false;
  #listener: TransportListener | undefined;
  #deliveries: Uint8Array[] = [];
  #is_delivering = false;

  static async start(options: ServiceOptions): Promise<TestService> {
    const { default: create } = (await import(/* @vite-ignore */ new URL("test_service.js", built).href)) as {
      default(options: object): Promise<WasmModule>;
    };
    const code = await WebAssembly.compile(readFileSync(new URL("test_service.wasm", built)));
    const module = await create({
      instantiateWasm(imports: WebAssembly.Imports, done: (instance: WebAssembly.Instance) => void) {
        void WebAssembly.instantiate(code, imports).then(done);
        return {};
      },
    });
    return new TestService(module, options);
  }

  private constructor(
    private readonly module: WasmModule,
    private readonly options: ServiceOptions,
  ) {
    this.service = new module.Service({ version: 4, stringTable: true, ...options }, performance.now());
    if (this.service.error()) throw new Error(this.service.error());
  }
  private readonly service: WasmService;

  connect(options: ConnectOptions = {}): Promise<RemoteObject> {
    return connect("ws://test.example/?service=test", { transport: this.transport, ...options });
  }

  readonly transport: OpenTransport = (_url, listener) => {
    this.#listener = listener;
    queueMicrotask(() => listener.opened());
    const self = this;
    return {
      send: (bytes) => this.#receive(bytes.slice()),
      get buffered() {
        return self.buffered;
      },
      close: () => {
        this.is_closed = true;
      },
    };
  };

  /** The stream breaks. */
  drop(reason: string): void {
    this.#listener?.closed(reason);
  }

  /** Bytes that the service never sent. */
  garbage(bytes: Uint8Array): void {
    this.#listener?.received(bytes);
  }

  stop(): void {
    this.service.stop();
    this.#poll();
  }

  release(path: string): void {
    this.service.release(path);
    this.#poll();
  }

  #receive(bytes: Uint8Array): void {
    this.sent.push(bytes);
    if (this.is_mute) return;
    this.service.set_now(performance.now());
    const address = this.service.receive_buffer(bytes.length);
    this.module.HEAPU8.set(bytes, address);
    this.service.handle_bytes();
    this.#poll();
  }

  #poll(): void {
    for (let bytes = this.service.poll_transmit(); bytes; bytes = this.service.poll_transmit()) {
      const size = this.options.pieces ?? bytes.length;
      for (let from = 0; from < bytes.length; from += size) this.#deliveries.push(bytes.slice(from, from + size));
      this.service.handle_transmitted(bytes.length);
    }
    if (this.#is_delivering || this.#deliveries.length === 0) return;
    this.#is_delivering = true;
    queueMicrotask(() => {
      this.#is_delivering = false;
      for (const bytes of this.#deliveries.splice(0)) if (!this.is_closed) this.#listener?.received(bytes);
      if (this.service.wants_close() && !this.is_closed) this.drop("closed by the service");
    });
  }
}

/** What a promise rejects with. */
export async function failure(promise: Promise<unknown>): Promise<any> {
  try {
    await promise;
  } catch (error) {
    return error;
  }
  throw new Error("it did not reject");
}

/** Lets everything run that is ready to run, and the services that it talks to. */
export async function settle(): Promise<void> {
  for (let i = 0; i < 50; ++i) await Promise.resolve();
}
