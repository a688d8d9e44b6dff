// A service in the same process: the core's service side as WebAssembly (service/test_service.cpp), behind a transport
// that keeps what went over it. It works with any definition:
//   properties, wires        keep what they are given, and give it back; wires send it when they are connected
//   functions                return their first argument; these do something besides:
//     fire_EVENT(...)        fires EVENT with the same arguments
//     publish_WIRE(value)    sends the InValue of WIRE
//     stream_PIPE(value, n)  sends the value n times to each endpoint of PIPE
//     close_PIPE()           closes all endpoints of PIPE
//     ask_CALLBACK(...)      calls CALLBACK of the client with the same arguments; its answer is the function's
//     release(path)          releases an object
//     fail(name, text)       raises the exception `name` with sub name "detail" and the parameter int32[] 1, 2
//     who()                  the user, or "nobody"
//     hang(), stop()         never answers; closes the service
//   pipes                    send packets back; "greeting" says hello, world while it is connected; "refused" refuses;
//                            "mute" never answers
//   generator functions      give each value back that they are given; those that take none count to their first
//                            argument from 0 (if it is negative, OutOfRange "no more" follows); "refuse" refuses,
//                            "hang_on" never answers a step; the property generator_end says how the last one ended
//   memories of double       10 numbers, or 4 * 3; at first 0, 1, 2 ...
//   objrefs                  of every index but "missing" and 99; a property `name` tells which
// Service "test", node "test.service", attribute site = "dock".
import { readFileSync } from "node:fs";
import * as page from "../../wasm-client/dist/node.js";
import { JsValues } from "../../wasm-client/dist/internal.js";
import type { CoreExports, Handle } from "../../wasm-client/dist/internal.js";
import type {
  ConnectOptions,
  DynamicMember,
  ObjectInfo,
  OpenTransport,
  TransportListener,
} from "../../wasm-client/dist/node.js";

/* eslint-disable @typescript-eslint/naming-convention -- names of C++ */
interface WasmService extends CoreExports {
  _initialize(): void;
  open(options: Handle, steady: number): Handle;
  set_now(steady: number): void;
  receive_buffer(size: number): number;
  handle_bytes(): void;
  join(): number;
  select(client: number): void;
  poll_timeout(): number;
  handle_timeout(): void;
  release(path: Handle): void;
  stop(): void;
  wants_close(): number;
  poll_transmit(): number;
  transmit_address(): number;
  handle_transmitted(size: number): void;
}
/* eslint-enable @typescript-eslint/naming-convention */

/** The client's, in a page or by a worker: vitest.config.ts runs the tests that use them with both. */
export const { connect, subscribe } = process.env["IN_WORKER"] ? await import("./thread_in_place.js") : page;

const built = new URL("../../build/wasm/test/wasm-client/service/", import.meta.url);
let compiled: Promise<WebAssembly.Module> | undefined;

export interface ServiceOptions {
  definitions: string[];
  root: string;
  version?: 2 | 4;
  stringTable?: boolean;
  /** Users alice and bob (password "secret") may log in; whether they have to. */
  requireUser?: boolean;
  /** The service's bytes arrive in pieces of this size. */
  pieces?: number;
}

/** An object whose members these tests know: each is said to be there (`robot["speed"]!`). */
export type NamedObject = { readonly $: ObjectInfo } & Readonly<Record<string, DynamicMember>>;

export class TestService {
  /** What the client sent, one item a frame. */
  readonly sent: Uint8Array[] = [];
  /** Bytes that the transport says it holds back. */
  buffered = 0;
  /** What the client sends gets lost. */
  isMute = false;
  /** Whether the client has closed the transport. */
  isClosed = false;
  #listener: TransportListener | undefined;
  #deliveries: Uint8Array[] = [];
  #isDelivering = false;
  #timer: ReturnType<typeof setTimeout> | undefined;
  readonly #number: number;

  static async start(options: ServiceOptions): Promise<TestService> {
    compiled ??= WebAssembly.compile(readFileSync(new URL("test_service.wasm", built)));
    const values = new JsValues();
    const { exports } = await WebAssembly.instantiate(await compiled, values.imports);
    const service = exports as unknown as WasmService;
    values.attach(service);
    service._initialize();
    const all = { version: 4, stringTable: true, ...options };
    const error = values.take(service.open(values.give(all), performance.now()));
    if (error) throw new Error(String(error));
    return new TestService(values, service, options, []);
  }

  private constructor(
    private readonly values: JsValues,
    private readonly service: WasmService,
    private readonly options: ServiceOptions,
    /** All clients of the service, by number. */
    private readonly clients: TestService[],
  ) {
    this.#number = clients.push(this) - 1;
  }

  /** The way of one more client to the same service. */
  join(): TestService {
    this.service.join();
    return new TestService(this.values, this.service, this.options, this.clients);
  }

  connect(options: ConnectOptions = {}): Promise<NamedObject> {
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
        this.isClosed = true;
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
    this.#select().stop();
    this.#poll();
  }

  release(path: string): void {
    this.#select().release(this.values.give(path));
    this.#poll();
  }

  #receive(bytes: Uint8Array): void {
    this.sent.push(bytes);
    if (this.isMute) return;
    const service = this.#select();
    const address = service.receive_buffer(bytes.length);
    this.values.bytes.set(bytes, address);
    service.handle_bytes();
    this.#poll();
  }

  /** The service, with its mind on this client. */
  #select(): WasmService {
    this.service.select(this.#number);
    this.service.set_now(performance.now());
    return this.service;
  }

  /** What one client says may be news for all. */
  #poll(): void {
    for (const client of this.clients) {
      client.#transmit();
      client.#armTimer();
    }
  }

  #transmit(): void {
    const service = this.#select();
    for (let length = service.poll_transmit(); length > 0; length = service.poll_transmit()) {
      const address = service.transmit_address();
      const bytes = this.values.bytes.slice(address, address + length);
      const size = this.options.pieces ?? bytes.length;
      for (let from = 0; from < bytes.length; from += size) this.#deliveries.push(bytes.slice(from, from + size));
      service.handle_transmitted(bytes.length);
    }
    if (this.#isDelivering || this.#deliveries.length === 0) return;
    this.#isDelivering = true;
    queueMicrotask(() => {
      this.#isDelivering = false;
      for (const bytes of this.#deliveries.splice(0)) if (!this.isClosed) this.#listener?.received(bytes);
      if (this.#select().wants_close() && !this.isClosed) this.drop("closed by the service");
    });
  }

  /** Of what a service does by itself, only what clients wait for from one another is tested. */
  #armTimer(): void {
    clearTimeout(this.#timer);
    if (this.clients.length < 2 || this.isClosed) return;
    const delay = this.#select().poll_timeout() - performance.now();
    this.#timer = setTimeout(
      () => {
        this.#select().handle_timeout();
        this.#poll();
      },
      Math.min(Math.max(Math.ceil(delay), 0), 2 ** 31 - 1),
    );
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

/** Before a test has put a clock of its own in its place. */
const { setImmediate } = globalThis;

/** Lets everything run that is ready to run, and the services that it talks to; with a worker, what they say to one another. */
export async function settle(): Promise<void> {
  const turns = process.env["IN_WORKER"] ? 20 : 1;
  for (let turn = 0; turn < turns; ++turn) {
    for (let i = 0; i < 50; ++i) await Promise.resolve();
    if (turns > 1) await new Promise((resolve) => setImmediate(resolve));
  }
}
