// The compiled core: the only file that knows its handles and its memory. Layer: wasm-client/ts.
// Source: src/wasm_session.hpp, and core/session/client_session.hpp behind it.
import { load_wasm } from "#load-wasm";
import { RobotRaconteurError } from "./errors.js";
import type { ErrorFields } from "./errors.js";
import createRrgate from "./rrgate.js";
import type { WasmModule, WasmSession } from "./rrgate.js";
import type { MemberInfo, RrValue, SessionStats } from "./types.js";

export interface CoreOptions {
  service: string;
  nodeId?: string | undefined;
  nodeName?: string | undefined;
  selfName?: string | undefined;
  username?: string | undefined;
  credentials?: object | undefined;
  objectType?: string | undefined;
  version?: number | undefined;
  stringTable?: boolean | undefined;
  connectTimeout?: number | undefined;
  requestTimeout?: number | undefined;
  maxMessageSize?: number | undefined;
}

export type CoreEvent =
  | { kind: "connected"; type: string }
  | { kind: "completed"; id: number; value: RrValue }
  | { kind: "failed"; id: number; error: ErrorFields }
  | { kind: "event"; path: string; member: string; arguments: RrValue[] }
  | { kind: "wire"; path: string; member: string; seconds: number; nanoseconds: number; value: RrValue }
  | { kind: "wire_closed"; path: string; member: string }
  | { kind: "path_released"; path: string }
  | { kind: "closed"; error: ErrorFields };

/** Native peers take WebSocket frames of at most this many bytes. */
const frame_limit = 65_535;
/** Bytes that go into the core at once; its receive buffer stays as small. */
const receive_limit = 1024 * 1024;

let compiled: Promise<WebAssembly.Module> | undefined;

/**
 * One session of the core, in an instance of its own: its memory goes with it, and a trap in it ends nothing else.
 * All methods follow the order of the sans-IO contract: after whatever is told or asked, poll.
 */
export class Core {
  readonly #module: WasmModule;
  readonly #session: WasmSession;

  /** @throws Error where the WebAssembly file cannot be loaded. */
  static async create(options: CoreOptions): Promise<Core> {
    compiled ??= load_wasm().catch((error: unknown) => {
      compiled = undefined; // the next connect() tries again
      throw error;
    });
    const code = await compiled;
    const wasm = await createRrgate({
      instantiateWasm(imports, done) {
        void WebAssembly.instantiate(code, imports).then(done);
        return {};
      },
    });
    return new Core(wasm, options);
  }

  private constructor(wasm: WasmModule, options: CoreOptions) {
    this.#module = wasm;
    this.#session = new wasm.Session(options, performance.now(), Date.now());
  }

  // --- told ---

  handle_bytes(bytes: Uint8Array): void {
    for (let from = 0; from < bytes.length; from += receive_limit) {
      const part = bytes.subarray(from, from + receive_limit);
      const session = this.#at_now();
      const address = session.receive_buffer(part.length);
      this.#module.HEAPU8.set(part, address);
      session.handle_bytes(part.length);
    }
  }

  handle_transmitted(size: number): void {
    this.#at_now().handle_transmitted(size);
  }

  handle_timeout(): void {
    this.#at_now().handle_timeout();
  }

  handle_closed(reason: string): void {
    this.#at_now().handle_closed(reason);
  }

  // --- asked: the number of the request; throws RobotRaconteurError for values that do not fit ---

  set_request_timeout(milliseconds: number): void {
    this.#session.set_request_timeout(milliseconds);
  }

  get_property(path: string, member: string): number {
    return this.#checked(this.#at_now().get_property(path, member));
  }

  set_property(path: string, member: string, value: unknown): number {
    return this.#checked(this.#at_now().set_property(path, member, value));
  }

  call_function(path: string, member: string, args: readonly unknown[]): number {
    return this.#checked(this.#at_now().call_function(path, member, args));
  }

  find_object(path: string): number {
    return this.#checked(this.#at_now().find_object(path));
  }

  connect_wire(path: string, member: string): number {
    return this.#checked(this.#at_now().connect_wire(path, member));
  }

  disconnect_wire(path: string, member: string): number {
    return this.#checked(this.#at_now().disconnect_wire(path, member));
  }

  peek_in_value(path: string, member: string): number {
    return this.#checked(this.#at_now().peek_in_value(path, member));
  }

  peek_out_value(path: string, member: string): number {
    return this.#checked(this.#at_now().peek_out_value(path, member));
  }

  poke_out_value(path: string, member: string, value: unknown): number {
    return this.#checked(this.#at_now().poke_out_value(path, member, value));
  }

  send_wire(path: string, member: string, value: unknown): void {
    this.#checked(this.#at_now().send_wire(path, member, value) ? 1 : 0);
  }

  cancel(id: number): void {
    this.#session.cancel(id);
  }

  disconnect(): void {
    this.#at_now().disconnect();
  }

  // --- answers ---

  /** Bytes to send now, in the core's own memory: copy them, then call handle_transmitted() before anything else. */
  poll_transmit(): Uint8Array | undefined {
    return this.#session.poll_transmit(frame_limit);
  }

  wants_close(): boolean {
    return this.#session.wants_close();
  }

  /** By performance.now(); Infinity for never. */
  poll_timeout(): number {
    return this.#session.poll_timeout();
  }

  poll_event(): CoreEvent | undefined {
    return this.#session.poll_event() as CoreEvent | undefined;
  }

  // --- looked at ---

  stats(): SessionStats {
    return this.#session.stats() as SessionStats;
  }

  peer(): { id: string; name: string } {
    return this.#session.peer() as { id: string; name: string };
  }

  attributes(): Map<string, RrValue> {
    return this.#session.attributes() as Map<string, RrValue>;
  }

  definitions(): string[] {
    return this.#session.definitions() as string[];
  }

  /** Of an object that was found. */
  members(path: string): MemberInfo[] {
    return (this.#session.members(path) as MemberInfo[] | undefined) ?? [];
  }

  child_path(parent: string, member: string, index: string | undefined): string {
    return this.#session.child_path(parent, member, index);
  }

  dispose(): void {
    this.#session.delete();
  }

  #at_now(): WasmSession {
    this.#session.set_now(performance.now(), Date.now());
    return this.#session;
  }

  #checked(id: number): number {
    if (id === 0) throw new RobotRaconteurError(this.#session.take_error() as ErrorFields);
    return id;
  }
}
