// The compiled core: the only file that knows its handles and its memory. Layer: wasm-client/ts.
// Source: src/wasm_session.hpp, and core/session/client/client_session.hpp behind it.
import { makeError, RobotRaconteurError } from "./errors.js";
import type { ErrorFields } from "./errors.js";
import { JsValues } from "./js_values.js";
import type { CoreExports, Handle } from "./js_values.js";
import { Once } from "./once.js";
import { frameLimit, receiveLimit } from "./outflow.js";
import { platform } from "./platform.js";
import type { MemberInfo, PipeConnectOptions, RrValue, SessionStats, TypeInfo } from "./types.js";

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
  maxMessageSize?: number | undefined;
  /** What known_definitions() of an earlier session gave, or []: definitions that the service need not send again. */
  known?: KnownDefinitions | undefined;
}

/** For each set of definitions its name, the service's tag for it, and the texts; to be kept, not to be read. */
export type KnownDefinitions = readonly (readonly string[])[];

export interface RawConstant {
  name: string;
  type: string;
  /** As it stands in the definition. */
  text: string;
  documentation: string;
}

/** See make_js_definition() in src/object_info.hpp. */
export interface RawDefinition {
  name: string;
  documentation: string;
  constants: RawConstant[];
  enums: { name: string; values: { name: string; value: number; documentation: string }[]; documentation: string }[];
  exceptions: { name: string; documentation: string }[];
  types: {
    name: string;
    kind: TypeInfo["kind"];
    constants: RawConstant[];
    members: MemberInfo[];
    implements: string[];
    documentation: string;
  }[];
}

export type CoreEvent =
  | { kind: "connected"; type: string }
  | { kind: "completed"; id: number; value: RrValue }
  | { kind: "failed"; id: number; error: ErrorFields }
  | { kind: "event"; path: string; member: string; arguments: RrValue[] }
  | { kind: "wire"; path: string; member: string; seconds: number; nanoseconds: number; value: RrValue }
  | { kind: "wire_closed"; path: string; member: string }
  | { kind: "pipe"; path: string; member: string; index: number; value: RrValue }
  | { kind: "pipe_acks"; path: string; member: string; index: number; numbers: number[] }
  /** `error`: of this side, where it closed the endpoint. */
  | { kind: "pipe_closed"; path: string; member: string; index: number; error?: ErrorFields }
  | { kind: "callback"; id: number; path: string; member: string; arguments: RrValue[] }
  | { kind: "path_released"; path: string }
  | { kind: "closed"; error: ErrorFields };

/** As rr::GeneratorStep. */
const generatorSteps = ["next", "close", "abort"] as const;
export type GeneratorStep = (typeof generatorSteps)[number];

/* eslint-disable @typescript-eslint/naming-convention -- names of C++ */
/** What src/bindings.cpp exports. */
interface WasmSession extends CoreExports {
  /** Runs what C++ runs before main(). */
  _initialize(): void;
  open(options: Handle, steady: number, utc: number): Handle;
  set_now(steady: number, utc: number): void;
  receive_buffer(size: number): number;
  handle_bytes(size: number): void;
  handle_transmitted(size: number): void;
  handle_timeout(): void;
  handle_closed(reason: Handle): void;
  set_request_timeout(milliseconds: number): void;
  get_property(path: Handle, member: Handle): number;
  set_property(path: Handle, member: Handle, value: Handle): number;
  call_function(path: Handle, member: Handle, args: Handle): number;
  open_generator(path: Handle, member: Handle, args: Handle): number;
  step_generator(step: number, path: Handle, member: Handle, index: number, parameter: Handle): number;
  get_memory_dimensions(path: Handle, member: Handle): number;
  read_memory(path: Handle, member: Handle, position: Handle, count: Handle): number;
  write_memory(path: Handle, member: Handle, position: Handle, value: Handle): number;
  find_object(path: Handle): number;
  connect_wire(path: Handle, member: Handle): number;
  disconnect_wire(path: Handle, member: Handle): number;
  peek_in_value(path: Handle, member: Handle): number;
  peek_out_value(path: Handle, member: Handle): number;
  poke_out_value(path: Handle, member: Handle, value: Handle): number;
  send_wire(path: Handle, member: Handle, value: Handle): number;
  connect_pipe(path: Handle, member: Handle, index: number): number;
  disconnect_pipe(path: Handle, member: Handle, index: number): number;
  send_pipe_packet(path: Handle, member: Handle, index: number, value: Handle, wants_ack: boolean): number;
  authenticate(username: Handle, credentials: Handle): number;
  logout(): number;
  get_attributes(): number;
  lock(path: Handle, is_for_client: boolean): number;
  unlock(path: Handle): number;
  enter_monitor(path: Handle, milliseconds: number): number;
  exit_monitor(path: Handle): number;
  lease(path: Handle, command: number, deadman: number): number;
  set_urgent(is_urgent: boolean): void;
  reply_callback(id: number, path: Handle, member: Handle, value: Handle): Handle;
  fail_callback(id: number, error: Handle): void;
  cancel(id: number): void;
  disconnect(): void;
  poll_transmit(limit: number): number;
  transmit_address(): number;
  wants_close(): number;
  poll_timeout(): number;
  poll_event(): Handle;
  take_error(): Handle;
  queued_bytes(): number;
  stats(): Handle;
  peer(): Handle;
  attributes(): Handle;
  definitions(): Handle;
  known_definitions(): Handle;
  definition(name: Handle): Handle;
  members(path: Handle): Handle;
}
/* eslint-enable @typescript-eslint/naming-convention */

/** The core's file: where it is, or what is in it. A string may be relative to the page. */
export type WasmSource = string | URL | BufferSource | WebAssembly.Module;

export interface InitOptions {
  /** Instead of rrgate.wasm beside the script: where a bundler puts it elsewhere, or has it in the script. */
  wasm?: WasmSource | Promise<WasmSource> | (() => WasmSource | Promise<WasmSource>) | undefined;
}

let source: InitOptions["wasm"];
const compiled = new Once(compile, "the protocol core could not be loaded");

/**
 * Says where the protocol core comes from. Before the first connect(), subscribe() or preload().
 * @throws RobotRaconteurError InvalidOperation: it is loaded already.
 */
export function init({ wasm }: InitOptions): void {
  if (compiled.isBegun) throw makeError("InvalidOperation", "init: the protocol core is loaded already; call it first");
  source = wasm;
}

/**
 * Loads the protocol core, for connections to come. Without it the first one does, while its socket opens.
 * @throws RobotRaconteurError (rejects) SystemResourceError: the file cannot be loaded; a later call tries again.
 */
export async function preload(): Promise<void> {
  await compiled.get();
}

async function compile(): Promise<WebAssembly.Module> {
  // Written out so that bundlers see it and ship the file.
  if (source === undefined) return platform.loadWasm(new URL("./rrgate.wasm", import.meta.url));
  const from = source; // to the compiler, a Module may be a function, too: it has no members
  const give = async () => (typeof from === "function" ? (from as () => WasmSource | Promise<WasmSource>)() : from);
  const given = await give();
  if (given instanceof WebAssembly.Module) return given;
  if (typeof given === "string") return platform.loadWasm(new URL(given, globalThis.location?.href));
  return given instanceof URL ? platform.loadWasm(given) : WebAssembly.compile(given);
}

/** Of a session that has not begun. */
export const noStats: SessionStats = { messagesReceived: 0, messagesSent: 0, bytesReceived: 0, bytesSent: 0 };

/**
 * One session of the core, in an instance of its own: its memory goes with it, and a trap in it ends nothing else.
 * All methods follow the order of the sans-IO contract: after whatever is told or asked, poll.
 */
export class Core {
  readonly #values: JsValues;
  readonly #session: WasmSession;

  /** @throws RobotRaconteurError SystemResourceError: the file cannot be loaded; those of options that make no sense. */
  static async create(options: CoreOptions): Promise<Core> {
    const code = await compiled.get();
    const values = new JsValues();
    const { exports } = await WebAssembly.instantiate(code, values.imports);
    return new Core(values, exports as unknown as WasmSession, options);
  }

  private constructor(values: JsValues, session: WasmSession, options: CoreOptions) {
    this.#values = values;
    this.#session = session;
    values.attach(session);
    session._initialize();
    const error = values.take(session.open(values.give(options), performance.now(), Date.now()));
    if (error) throw new RobotRaconteurError(error as ErrorFields);
  }

  // --- told ---

  handleBytes(bytes: Uint8Array): void {
    for (let from = 0; from < bytes.length; from += receiveLimit) {
      const part = bytes.subarray(from, from + receiveLimit);
      const session = this.#atNow();
      const address = session.receive_buffer(part.length);
      this.#values.bytes.set(part, address);
      session.handle_bytes(part.length);
    }
  }

  handleTransmitted(size: number): void {
    this.#atNow().handle_transmitted(size);
  }

  handleTimeout(): void {
    this.#atNow().handle_timeout();
  }

  handleClosed(reason: string): void {
    this.#atNow().handle_closed(this.#values.give(reason));
  }

  // --- asked: the number of the request; throws RobotRaconteurError for values that do not fit ---

  /** For what follows; `isUrgent`: requests on members are sent past whatever waits. */
  prepareRequest(timeout: number, isUrgent: boolean): void {
    this.#session.set_request_timeout(timeout);
    this.#session.set_urgent(isUrgent);
  }

  getProperty(path: string, member: string): number {
    return this.#ask("get_property", path, member);
  }

  setProperty(path: string, member: string, value: unknown): number {
    return this.#ask("set_property", path, member, value);
  }

  callFunction(path: string, member: string, args: readonly unknown[]): number {
    return this.#ask("call_function", path, member, args);
  }

  /** Without the generator parameter, which comes with each step. */
  openGenerator(path: string, member: string, args: readonly unknown[]): number {
    return this.#ask("open_generator", path, member, args);
  }

  /** `sent`: the parameter fits, so that the service hears of the step. */
  stepGenerator(
    step: GeneratorStep,
    path: string,
    member: string,
    index: number,
    parameter: unknown,
    sent: () => void,
  ): number {
    const number = generatorSteps.indexOf(step);
    const handle = this.#give(parameter);
    const id = this.#checked(this.#atNow().step_generator(number, this.#give(path), this.#give(member), index, handle));
    sent();
    return id;
  }

  getMemoryDimensions(path: string, member: string): number {
    return this.#ask("get_memory_dimensions", path, member);
  }

  readMemory(path: string, member: string, position: readonly number[], count: readonly number[]): number {
    return this.#ask("read_memory", path, member, position, count);
  }

  writeMemory(path: string, member: string, position: readonly number[], value: unknown): number {
    return this.#ask("write_memory", path, member, position, value);
  }

  findObject(path: string): number {
    return this.#ask("find_object", path);
  }

  connectWire(path: string, member: string): number {
    return this.#ask("connect_wire", path, member);
  }

  disconnectWire(path: string, member: string): number {
    return this.#ask("disconnect_wire", path, member);
  }

  peekInValue(path: string, member: string): number {
    return this.#ask("peek_in_value", path, member);
  }

  peekOutValue(path: string, member: string): number {
    return this.#ask("peek_out_value", path, member);
  }

  pokeOutValue(path: string, member: string, value: unknown): number {
    return this.#ask("poke_out_value", path, member, value);
  }

  /** Where the core is in another thread, that takes time, here and for packets. */
  sendWire(path: string, member: string, value: unknown): void | Promise<void> {
    this.#ask("send_wire", path, member, value);
  }

  /** `index` -1: any. `_limits`: of what may wait for the page, where the core is in another thread. */
  connectPipe(path: string, member: string, index: number, _limits?: PipeConnectOptions): number {
    return this.#checked(this.#atNow().connect_pipe(this.#give(path), this.#give(member), index));
  }

  disconnectPipe(path: string, member: string, index: number): number {
    return this.#checked(this.#atNow().disconnect_pipe(this.#give(path), this.#give(member), index));
  }

  /** `sent`: told the packet's number. */
  sendPipePacket(
    path: string,
    member: string,
    index: number,
    value: unknown,
    wantsAck: boolean,
    sent: (number: number) => void,
  ): void | Promise<void> {
    const number = this.#atNow().send_pipe_packet(
      this.#give(path),
      this.#give(member),
      index,
      this.#give(value),
      wantsAck,
    );
    if (number < 0) this.#checked(0);
    sent(number);
  }

  authenticate(username: string, credentials: unknown): number {
    return this.#ask("authenticate", username, credentials);
  }

  logout(): number {
    return this.#ask("logout");
  }

  getAttributes(): number {
    return this.#ask("get_attributes");
  }

  lock(path: string, kind: "user" | "client"): number {
    return this.#checked(this.#atNow().lock(this.#give(path), kind === "client"));
  }

  unlock(path: string): number {
    return this.#ask("unlock", path);
  }

  /** `milliseconds` below 0: no limit. */
  enterMonitor(path: string, milliseconds: number): number {
    return this.#checked(this.#atNow().enter_monitor(this.#give(path), milliseconds));
  }

  /** `command`: see leaseCommands. */
  lease(path: string, command: number, deadman: number): number {
    return this.#checked(this.#atNow().lease(this.#give(path), command, deadman));
  }

  exitMonitor(path: string): number {
    return this.#ask("exit_monitor", path);
  }

  /** @throws RobotRaconteurError where the value does not fit; the service has been told so, too. */
  replyCallback(id: number, path: string, member: string, value: unknown): void {
    const handles = [this.#give(path), this.#give(member), this.#give(value)] as const;
    const error = this.#values.take(this.#atNow().reply_callback(id, ...handles));
    if (error) throw new RobotRaconteurError(error as ErrorFields);
  }

  failCallback(id: number, error: Partial<ErrorFields>): void {
    this.#atNow().fail_callback(id, this.#give(error));
  }

  cancel(id: number): void {
    this.#session.cancel(id);
  }

  disconnect(): void {
    this.#atNow().disconnect();
  }

  // --- answers ---

  /** Bytes to send now, in the core's own memory: copy them, then call handle_transmitted() before anything else. */
  pollTransmit(): Uint8Array | undefined {
    const size = this.#session.poll_transmit(frameLimit);
    if (size === 0) return undefined;
    const address = this.#session.transmit_address();
    return this.#values.bytes.subarray(address, address + size);
  }

  wantsClose(): boolean {
    return this.#session.wants_close() !== 0;
  }

  /** By performance.now(); Infinity for never. */
  pollTimeout(): number {
    return this.#session.poll_timeout();
  }

  pollEvent(): CoreEvent | undefined {
    return this.#values.take(this.#session.poll_event()) as CoreEvent | undefined;
  }

  // --- looked at ---

  /** What waits for the transport. */
  queuedBytes(): number {
    return this.#session.queued_bytes();
  }

  stats(): SessionStats {
    return this.#values.take(this.#session.stats()) as SessionStats;
  }

  peer(): { id: string; name: string } {
    return this.#values.take(this.#session.peer()) as { id: string; name: string };
  }

  attributes(): Map<string, RrValue> {
    return this.#values.take(this.#session.attributes()) as Map<string, RrValue>;
  }

  definitions(): string[] {
    return this.#values.take(this.#session.definitions()) as string[];
  }

  knownDefinitions(): KnownDefinitions {
    return this.#values.take(this.#session.known_definitions()) as KnownDefinitions;
  }

  definition(name: string): RawDefinition | undefined | Promise<RawDefinition | undefined> {
    return this.#values.take(this.#session.definition(this.#give(name))) as RawDefinition | undefined;
  }

  /** Of an object that was found. */
  members(path: string): MemberInfo[] {
    return (this.#values.take(this.#session.members(this.#give(path))) as MemberInfo[] | undefined) ?? [];
  }

  #atNow(): WasmSession {
    this.#session.set_now(performance.now(), Date.now());
    return this.#session;
  }

  #give(value: unknown): Handle {
    return this.#values.give(value);
  }

  #checked(id: number): number {
    if (id === 0) throw new RobotRaconteurError(this.#values.take(this.#session.take_error()) as ErrorFields);
    return id;
  }

  /** Makes a request of the core with `args`. */
  #ask(request: MemberRequest, ...args: unknown[]): number {
    const session = this.#atNow();
    const handles = args.map((arg) => this.#values.give(arg)) as [Handle, Handle, Handle, Handle];
    return this.#checked(session[request](...handles));
  }
}

/** Those that take handles alone and give the number of a request, or 0. */
type MemberRequest =
  | "get_property"
  | "set_property"
  | "call_function"
  | "open_generator"
  | "find_object"
  | "get_memory_dimensions"
  | "read_memory"
  | "write_memory"
  | "authenticate"
  | "logout"
  | "get_attributes"
  | "unlock"
  | "exit_monitor"
  | "connect_wire"
  | "disconnect_wire"
  | "peek_in_value"
  | "peek_out_value"
  | "poke_out_value"
  | "send_wire";
