// The compiled service side of the core: the only file that knows its handles and its memory. Layer: wasm-client/ts.
// Source: src/serve_bindings.cpp, and core/session/service/service_session.hpp behind it.
import { errorFields, RobotRaconteurError } from "../errors.js";
import type { ErrorFields } from "../errors.js";
import { JsValues } from "../js_values.js";
import type { CoreExports, Handle } from "../js_values.js";
import { Once } from "../once.js";
import { frameLimit, receiveLimit } from "../outflow.js";
import { platform } from "../platform.js";
import type { MemberInfo, RrValue } from "../types.js";
import type { ServedObject } from "./served_object.js";

/** What a definition has to be known by. */
export interface ServiceOptions {
  nodeId: string;
  nodeName: string;
  service: string;
  type: string;
  definitions: readonly string[];
  maxMessageSize: number;
}

interface CallOf<Kind extends string> {
  kind: "call";
  call: Kind;
  id: number;
  object: ServedObject;
  member: string;
  /** Of functions. */
  arguments: RrValue[];
  /** What is set, poked, written, or brought by a step of a generator. */
  value: RrValue;
  seconds: number;
  nanoseconds: number;
  generator: number;
  position: number[];
  count: number[];
}

/** The kinds as rr::CallKind. */
export type ServiceCall = CallOf<
  | "property_get"
  | "property_set"
  | "function"
  | "peek_in"
  | "peek_out"
  | "poke_out"
  | "generator_open"
  | "generator_next"
  | "generator_close"
  | "generator_abort"
  | "memory_dimensions"
  | "memory_read"
  | "memory_write"
>;

export type ServiceEvent =
  | ServiceCall
  | { kind: "wire_connected"; object: ServedObject; member: string }
  | { kind: "wire"; object: ServedObject; member: string; value: RrValue; seconds: number; nanoseconds: number }
  | { kind: "pipe_connected"; id: number; object: ServedObject; member: string; index: number }
  | { kind: "pipe"; id: number; value: RrValue }
  | { kind: "pipe_closed"; id: number }
  | { kind: "generator_ended"; id: number }
  | { kind: "callback"; id: number; value?: RrValue; error?: ErrorFields }
  /** What others of the clients waited for may be theirs now. */
  | { kind: "locks_changed" }
  | { kind: "gone" };

/** What stands behind an objref. */
export type FindChild = (
  parent: ServedObject,
  member: string,
  index: string | undefined,
  path: string,
  type: string,
) => ServedObject;

/* eslint-disable @typescript-eslint/naming-convention -- names of C++ */
interface WasmService extends CoreExports {
  _initialize(): void;
  begin(options: Handle, root: Handle): Handle;
  set_now(steady: number, utc: number): void;
  open(url: Handle): number;
  forget(client: number): void;
  receive_buffer(size: number): number;
  handle_bytes(client: number, size: number): void;
  handle_transmitted(client: number, size: number): void;
  handle_timeout(client: number): void;
  handle_closed(client: number, reason: Handle): void;
  reply(client: number, call: number, value: Handle): Handle;
  fail(client: number, call: number, error: Handle): void;
  send_event(path: Handle, type: Handle, member: Handle, args: Handle): Handle;
  send_wire(client: number, path: Handle, type: Handle, member: Handle, value: Handle): Handle;
  accept_pipe(client: number, pipe: number): void;
  refuse_pipe(client: number, pipe: number, error: Handle): void;
  send_pipe(client: number, pipe: number, value: Handle): Handle;
  close_pipe(client: number, pipe: number): void;
  call_callback(client: number, path: Handle, type: Handle, member: Handle, args: Handle): Handle;
  release(path: Handle): void;
  close_service(): void;
  poll_transmit(client: number, limit: number): number;
  transmit_address(): number;
  wants_close(client: number): number;
  poll_timeout(client: number): number;
  poll_event(client: number): Handle;
  queued_bytes(client: number): number;
  members(type: Handle): Handle;
}
/* eslint-enable @typescript-eslint/naming-convention */

const compiled = new Once(
  // Written out so that bundlers see it and ship the file.
  () => platform.loadWasm(new URL("./rrgate-serve.wasm", import.meta.url)),
  "the protocol core for services could not be loaded",
);

/**
 * One service and its clients, by their numbers, in an instance of the core. All methods follow the order of the sans-IO
 * contract: after whatever is told or asked, poll.
 */
export class ServiceCore {
  readonly #values: JsValues;
  readonly #service: WasmService;

  /** @throws RobotRaconteurError SystemResourceError: the file cannot be loaded; ServiceDefinitionError, ... */
  static async create(options: ServiceOptions, root: ServedObject, findChild: FindChild): Promise<ServiceCore> {
    const code = await compiled.get();
    const values = new JsValues();
    const find = (parent: Handle, member: Handle, index: Handle, path: Handle, type: Handle): Handle => {
      const taken = [parent, member, index, path, type].map((handle) => values.take(handle));
      try {
        const object = findChild(...(taken as Parameters<FindChild>));
        return values.give({ object, type: object.type });
      } catch (error) {
        return values.give({ error: errorFields(error) });
      }
    };
    const { exports } = await WebAssembly.instantiate(code, {
      js: { ...values.imports.js, find_child: find },
    });
    return new ServiceCore(values, exports as unknown as WasmService, options, root);
  }

  private constructor(values: JsValues, service: WasmService, options: ServiceOptions, root: ServedObject) {
    this.#values = values;
    this.#service = service;
    values.attach(service);
    service._initialize();
    this.#check(service.begin(values.give(options), values.give(root)));
  }

  /** A client has connected. `url`: of the device, as the service index tells it. @returns the client's number. */
  open(url: string): number {
    return this.#atNow().open(this.#give(url));
  }

  forget(client: number): void {
    this.#service.forget(client);
  }

  // --- told ---

  handleBytes(client: number, bytes: Uint8Array): void {
    for (let from = 0; from < bytes.length; from += receiveLimit) {
      const part = bytes.subarray(from, from + receiveLimit);
      const address = this.#service.receive_buffer(part.length);
      this.#values.bytes.set(part, address);
      this.#atNow().handle_bytes(client, part.length);
    }
  }

  handleTransmitted(client: number, size: number): void {
    this.#atNow().handle_transmitted(client, size);
  }

  handleTimeout(client: number): void {
    this.#atNow().handle_timeout(client);
  }

  handleClosed(client: number, reason: string): void {
    this.#atNow().handle_closed(client, this.#give(reason));
  }

  // --- asked ---

  /** @throws RobotRaconteurError where the value does not fit; the client has been told so, too. */
  reply(client: number, call: number, value: unknown): void {
    this.#check(this.#atNow().reply(client, call, this.#give(value)));
  }

  fail(client: number, call: number, error: unknown): void {
    this.#atNow().fail(client, call, this.#give(errorFields(error)));
  }

  sendEvent({ path, type }: ServedObject, member: string, args: readonly unknown[]): void {
    const [at, of, name, values] = [path, type, member, args].map((each) => this.#give(each));
    this.#check(this.#atNow().send_event(at!, of!, name!, values!));
  }

  /** `client` 0: all. */
  sendWire(client: number, { path, type }: ServedObject, member: string, value: unknown): void {
    const [at, of, name, given] = [path, type, member, value].map((each) => this.#give(each));
    this.#check(this.#atNow().send_wire(client, at!, of!, name!, given!));
  }

  acceptPipe(client: number, pipe: number): void {
    this.#atNow().accept_pipe(client, pipe);
  }

  refusePipe(client: number, pipe: number, error: unknown): void {
    this.#atNow().refuse_pipe(client, pipe, this.#give(errorFields(error)));
  }

  sendPipe(client: number, pipe: number, value: unknown): void {
    this.#check(this.#atNow().send_pipe(client, pipe, this.#give(value)));
  }

  closePipe(client: number, pipe: number): void {
    this.#atNow().close_pipe(client, pipe);
  }

  /** @returns the call's number. */
  callCallback(client: number, { path, type }: ServedObject, member: string, args: readonly unknown[]): number {
    const [at, of, name, values] = [path, type, member, args].map((each) => this.#give(each));
    const called = this.#values.take(this.#atNow().call_callback(client, at!, of!, name!, values!));
    if (typeof called !== "number") throw new RobotRaconteurError(called as ErrorFields);
    return called;
  }

  release(path: string): void {
    this.#atNow().release(this.#give(path));
  }

  closeService(): void {
    this.#atNow().close_service();
  }

  // --- answers ---

  /** In the core's own memory: copy them, then call handleTransmitted() before anything else. */
  pollTransmit(client: number): Uint8Array | undefined {
    const size = this.#service.poll_transmit(client, frameLimit);
    if (size === 0) return undefined;
    const address = this.#service.transmit_address();
    return this.#values.bytes.subarray(address, address + size);
  }

  wantsClose(client: number): boolean {
    return this.#service.wants_close(client) !== 0;
  }

  /** By performance.now(); Infinity for never. */
  pollTimeout(client: number): number {
    return this.#service.poll_timeout(client);
  }

  pollEvent(client: number): ServiceEvent | undefined {
    return this.#values.take(this.#atNow().poll_event(client)) as ServiceEvent | undefined;
  }

  // --- looked at ---

  queuedBytes(client: number): number {
    return this.#service.queued_bytes(client);
  }

  members(type: string): MemberInfo[] {
    return (this.#values.take(this.#service.members(this.#give(type))) as MemberInfo[] | undefined) ?? [];
  }

  #atNow(): WasmService {
    this.#service.set_now(performance.now(), Date.now());
    return this.#service;
  }

  #give(value: unknown): Handle {
    return this.#values.give(value);
  }

  #check(error: Handle): void {
    const fields = this.#values.take(error);
    if (fields) throw new RobotRaconteurError(fields as ErrorFields);
  }
}
