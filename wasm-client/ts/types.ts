// The public types: what a connected object and its members look like. Layer: wasm-client/ts.
/// <reference lib="esnext.disposable" preserve="true" />
import type { RobotRaconteurError } from "./errors.js";

export type NumericArray =
  | Float64Array
  | Float32Array
  | Int8Array
  | Uint8Array
  | Int16Array
  | Uint16Array
  | Int32Array
  | Uint32Array
  | BigInt64Array
  | BigUint64Array;

export interface Complex<T = number> {
  re: T;
  im: T;
}

/** `data` is column-major: the first index runs fastest. */
export interface MultiDim<A = RrValue> {
  dims: number[];
  data: A;
}

/** Any value that a service can send; the table in README.md says which is which. */
export type RrValue =
  | null
  | boolean
  | number
  | bigint
  | string
  | NumericArray
  | Complex
  | Complex<Float64Array | Float32Array>
  | MultiDim
  | RrValue[]
  | Map<number, RrValue>
  | Map<string, RrValue>
  | { [field: string]: RrValue };

export interface CallOptions {
  /** Gives the call up: it rejects with the signal's reason. The service is not told and may still carry it out. */
  signal?: AbortSignal | undefined;
  /** Milliseconds until the call rejects with RequestTimeout; the session's `timeout` (15 s) where not given. */
  timeout?: number | undefined;
}

export interface LeaseOptions extends CallOptions {
  /** Milliseconds (50 to 60000) without renewal until the gateway makes the device safe; 1000 where not given. */
  deadman?: number;
  /** Takes it from whoever has it, with a role that may. */
  takeover?: boolean;
  /**
   * Milliseconds for calls of functions, and writes of properties and wires, of the object and those below it while the
   * lease is held, where they say nothing; 2000.
   */
  callTimeout?: number;
}

/**
 * "doubtful": the gateway has answered no renewal for the dead-man's time, as when the network is away: it may have made
 * the device safe. An answer makes it "held" or "lost".
 */
export type LeaseState = "held" | "doubtful" | "lost" | "released";

export interface Lease {
  readonly state: LeaseState;
  /** Whether `state` is "held". */
  readonly isHeld: boolean;
  /** Why it is doubtful or lost. */
  readonly reason: RobotRaconteurError | undefined;
  /** Calls `changed` with each new state. @returns a function that ends it. */
  onState(changed: (state: LeaseState, reason?: RobotRaconteurError) => void): () => void;
  /** Resolves when the lease has ended: with the reason, or without one after release(). Never rejects. */
  readonly ended: Promise<RobotRaconteurError | undefined>;
  /** Calls `lost` once when the lease ends without release(). @returns a function that takes it back. */
  onLost(lost: (reason: RobotRaconteurError) => void): () => void;
  /**
   * Ends it: the gateway makes the device safe. Of one that was lost: what it covered may be commanded again as without
   * it. Repeated calls do nothing.
   */
  release(): Promise<void>;
  [Symbol.asyncDispose](): Promise<void>;
}

export type MemberKind = "property" | "function" | "event" | "objref" | "pipe" | "callback" | "wire" | "memory";

export interface ParameterInfo {
  readonly name: string;
  readonly type: string;
}

/** A member as its definition declares it. */
export interface MemberInfo {
  readonly name: string;
  readonly kind: MemberKind;
  /** Value type; of functions and callbacks what they return, of objrefs the object with its index. */
  readonly type: string;
  readonly parameters: readonly ParameterInfo[];
  /** Such as "readonly". */
  readonly modifiers: readonly string[];
  readonly documentation: string;
}

/** A struct, pod, namedarray or object of a definition. */
export interface TypeInfo {
  /** Qualified: "com.example.Pose". */
  readonly name: string;
  readonly kind: "struct" | "pod" | "namedarray" | "object";
  /** Objects: qualified names of the types that it implements. */
  readonly implements: readonly string[];
  readonly constants: Readonly<Record<string, RrValue>>;
  /** Of values their fields, of kind "field". */
  readonly members: readonly (Omit<MemberInfo, "kind"> & { readonly kind: MemberKind | "field" })[];
  readonly documentation: string;
}

/** What a service definition declares. */
export interface DefinitionInfo {
  readonly name: string;
  readonly documentation: string;
  /** Values by name; int64 and uint64 as bigint, numeric arrays as TypedArray, structs as objects. */
  readonly constants: Readonly<Record<string, RrValue>>;
  /** The numbers of each enum by name: `enums.Mode?.run`. */
  readonly enums: Readonly<Record<string, Readonly<Record<string, number>>>>;
  /** Qualified names. */
  readonly exceptions: readonly string[];
  readonly types: Readonly<Record<string, TypeInfo>>;
  /** The documentation of constants ("LIMIT", "Robot.LIMIT"), enums and their values ("Mode", "Mode.run"), exceptions. */
  readonly notes: ReadonlyMap<string, string>;
}

export interface SessionStats {
  messagesReceived: number;
  messagesSent: number;
  bytesReceived: number;
  bytesSent: number;
}

/** "released": the service replaced this object; look it up again. */
export type ObjectState = "connected" | "released" | "closed";

/**
 * What belongs to the connection and not to the object's own members; under `$`, which no member can be called.
 * `T`: the object's type, `C`: the constants of its type and of the definition that it stands in.
 */
export interface ObjectInfo<T = RemoteObject, C = DefinitionInfo["constants"]> {
  readonly state: ObjectState;
  /** Qualified type, "experimental.create.Create". */
  readonly type: string;
  /** Service path, "Create.Webcams[0]". */
  readonly path: string;
  readonly members: readonly MemberInfo[];
  /** What the service says of itself. */
  readonly attributes: ReadonlyMap<string, RrValue>;
  /** The service's node. */
  readonly node: { readonly id: string; readonly name: string };
  /** The texts of all service definitions known so far. */
  readonly types: readonly string[];
  /**
   * The constants of the object's type and of the definition that it stands in; the type's own count where both have one
   * of a name. Rejects with InvalidOperation where the session is closed.
   */
  readonly constants: Promise<C>;
  /**
   * The constants, enums and types of a definition that the service has sent, with their documentation.
   * @param name  the definition's, "com.example.robot"; that of the object's type where not given.
   * @throws RobotRaconteurError (rejects) InvalidArgument (not known), InvalidOperation (the session is closed).
   */
  definition(name?: string): Promise<DefinitionInfo>;
  readonly stats: SessionStats;
  /**
   * The functions of the object, as they are called otherwise, but sent past whatever this side has not handed to the
   * WebSocket yet: `robot.$.urgent.Stop()`. That is all but the last 128 KiB. What it has passed follows it: an older call
   * that still waits to be sent arrives after it. By the name of a property its value is written, by that of a wire its OutValue:
   * `robot.$.urgent.speed(0)`.
   */
  readonly urgent: UrgentCommands<T>;
  /** A member by name: the way to those whose names JavaScript itself calls ("then", "toString"). */
  member(name: string): DynamicMember;
  /**
   * The object that a service path leads to, such as "Create.Webcams[0]"; "*" stands for the service's name.
   * @throws RobotRaconteurError (rejects) ObjectNotFound, ServiceNotFound, ...
   */
  find(path: string, options?: CallOptions): Promise<RemoteObject>;
  /**
   * Logs in, or in as another user: for the whole session.
   * @param credentials  what the service's authenticator wants to see; a string stands for `{password}`.
   * @throws RobotRaconteurError (rejects) AuthenticationError, ...
   */
  login(
    username: string,
    credentials: string | Record<string, unknown> | ReadonlyMap<string, unknown>,
    options?: CallOptions,
  ): Promise<void>;
  logout(options?: CallOptions): Promise<void>;
  /**
   * Locks this object and all below it, until unlock() or the end of the session.
   * @param kind  whom it keeps out: "user" all other users (the default), "client" all other sessions.
   * @throws RobotRaconteurError (rejects) ObjectLockedError, AuthenticationError (not logged in), ...
   */
  lock(kind?: "user" | "client", options?: CallOptions): Promise<void>;
  unlock(options?: CallOptions): Promise<void>;
  /**
   * Runs `action` while this object is this session's alone, then leaves it to others.
   * @param options.timeout  milliseconds to wait for it; without limit where not given.
   * @throws RobotRaconteurError (rejects) OperationTimeout, ...; what `action` throws.
   */
  monitor<R>(action: () => R | Promise<R>, options?: CallOptions): Promise<R>;
  /** Ends the session of this object and of all others that came from it. Repeated calls do nothing. */
  close(): Promise<void>;
  /**
   * Calls `closed` once when the session ends or the object is released: without argument after close() of this
   * side, else with the reason.
   * @returns a function that takes the callback back.
   */
  onClose(closed: (reason?: RobotRaconteurError) => void): () => void;
}

/** `robot.Drive(100, 5000)`: arguments by position, then CallOptions where wanted. */
export interface FunctionMember<A extends unknown[] = never[], R = RrValue> {
  /** @throws RobotRaconteurError (rejects): what the service raised, DataTypeMismatch, OutOfRange, ConnectionError, ... */
  (...args: A): Promise<R>;
  (...args: [...A, CallOptions]): Promise<R>;
}

/** `S`: what may be sent, where that is more than what is received (varvalue: also rrValue()). */
export interface PropertyMember<T = RrValue, S = T> {
  get(options?: CallOptions): Promise<T>;
  set(value: S, options?: CallOptions): Promise<void>;
}

export interface EventMember<A extends unknown[] = RrValue[]> extends AsyncIterable<A> {
  /** @returns a function that takes the listener back. */
  on(listener: (...args: A) => void): () => void;
  /** The next occurrence. */
  once(options?: CallOptions): Promise<A>;
}

export interface ObjRefMember<T = RemoteObject, I extends number | string | void = number | string | void> {
  /** Looks the object up. Rejects with ObjectNotFound and the like. */
  get(index: I, options?: CallOptions): Promise<T>;
}

export interface WireTime {
  /** Since 1970, UTC, by the sender's clock. */
  seconds: number;
  nanoseconds: number;
}

/** What became of the values of one subscription, by the account of the service: how many, and how old. */
export interface Losses {
  /** Handed to the connection. */
  delivered: number;
  /** Replaced by a newer one before that. */
  conflated: number;
  dropped: number;
  /** Milliseconds that half, and 99 %, of those delivered did not wait longer than; in steps of two. */
  ageP50: number;
  ageP99: number;
}

/**
 * A connected wire. Iterating gives the newest value each time; values that came in between are skipped. Leaving the
 * loop closes the connection.
 */
export interface WireConnection<T = RrValue, S = T> extends AsyncIterable<T>, AsyncDisposable {
  /** The newest value; undefined before the first. */
  readonly value: T | undefined;
  readonly time: WireTime | undefined;
  /** When the service has agreed; rejects where it refuses. */
  readonly ready: Promise<void>;
  /** Sends the OutValue; one that waits for a slow network is replaced by a newer one. */
  send(value: S): Promise<void>;
  /** What this session's values of the wire came to; undefined where the service keeps no account of it. */
  losses(options?: CallOptions): Promise<Losses | undefined>;
  close(): Promise<void>;
}

export interface WireMember<T = RrValue, S = T> {
  connect(options?: CallOptions): WireConnection<T, S>;
  /** The InValue, without connection. */
  peek(options?: CallOptions): Promise<T>;
  /** The OutValue as the service has it. */
  peekOut(options?: CallOptions): Promise<T>;
  /** Sets the OutValue, without connection. */
  poke(value: S, options?: CallOptions): Promise<void>;
}

export interface PipeConnectOptions extends CallOptions {
  /** Packets that may wait for the loop over the endpoint; one more closes it with an error. 10,000. */
  limit?: number | undefined;
  /** Bytes, about, that may wait so. 64 MiB. */
  maxBytes?: number | undefined;
}

export interface PipeSendOptions extends CallOptions {
  /** Whether to ask for an acknowledgement and wait for it. */
  ack?: boolean | undefined;
}

/**
 * One end of a pipe. Iterating gives every packet, in order, from the first; leaving the loop closes the endpoint. A
 * second loop shares the packets with the first.
 */
export interface PipeEndpoint<T = RrValue, S = T> extends AsyncIterable<T>, AsyncDisposable {
  /** As agreed with the service. */
  readonly index: number;
  readonly isClosed: boolean;
  /**
   * Sends a packet. Resolves when little waits for the network (who waits for it sends as fast as the network takes
   * it), with `ack` when the packet has arrived. Giving up does not take the packet back.
   * @throws RobotRaconteurError (rejects) InvalidOperation (closed), ReadOnlyMember, OutOfSystemResource (32 MiB wait for
   *         the network: the packet is not sent), DataTypeMismatch, ConnectionError, ...
   */
  send(packet: S, options?: PipeSendOptions): Promise<void>;
  /** What its packets came to; undefined where the service keeps no account of it. */
  losses(options?: CallOptions): Promise<Losses | undefined>;
  /** Calls `closed` once when the endpoint ends, with the reason where it was not closed in order. */
  onClose(closed: (reason?: unknown) => void): () => void;
  /** What waits in send() rejects; what was received can still be taken. Repeated calls do nothing. */
  close(): Promise<void>;
}

export interface PipeMember<T = RrValue, S = T> {
  /**
   * @param index  the endpoint's; any free one where not given. The service may choose another: see the endpoint's.
   * @throws RobotRaconteurError (rejects) what the service says, ConnectionError, RequestTimeout, ...
   */
  connect(index?: number, options?: PipeConnectOptions): Promise<PipeEndpoint<T, S>>;
  connect(options: PipeConnectOptions): Promise<PipeEndpoint<T, S>>;
}

/**
 * What the service asks of this client. The handler may return a promise. What it throws travels to the service:
 * RobotRaconteurError as it is, also with an exception that the definition declares (code 100 and its qualified name).
 * While there is no handler, the service gets InvalidOperation.
 */
export interface CallbackMember<A extends unknown[] = RrValue[], R = unknown> {
  handler: ((...args: A) => R | Promise<R>) | null;
}

/**
 * A large array that is read and written in parts. Positions (from 0) and counts have one number a dimension; a plain
 * array takes the number alone as well. Large parts travel in pieces: what others write meanwhile may be in some of them.
 * @throws RobotRaconteurError (rejects) OutOfRange, ReadOnlyMember, WriteOnlyMember, DataTypeMismatch, ...
 */
export interface MemoryMember<A = RrValue> {
  /** Of a plain array its length. */
  dimensions(options?: CallOptions): Promise<number[]>;
  read(position: number | readonly number[], count: number | readonly number[], options?: CallOptions): Promise<A>;
  /** All of `value`; where that fails, a part may be written. */
  write(position: number | readonly number[], value: A, options?: CallOptions): Promise<void>;
}

/**
 * A function whose results come one after another; where it takes values (`P`), each `next(value)` hands one over, also
 * the first. The service hears of a run with its first `next()`. `return()`, and so leaving the loop, closes it;
 * `throw(reason)` aborts it: at once, sent past whatever waits. A step that is under way then rejects, with OperationAborted
 * or the reason. Both resolve when the service has answered, and reject with what it says where it does not end the run.
 * What fails ends it. CallOptions stand for each step: a step that takes too long, or is given up, aborts the run; what
 * became of that `return()` tells.
 */
export interface GeneratorMember<A extends unknown[] = never[], R = RrValue, P = void> {
  (...args: A): AsyncGenerator<R, void, P>;
  (...args: [...A, CallOptions]): AsyncGenerator<R, void, P>;
}

/** A member where no type is known: everything that any member can do. What this one cannot do is missing on it. */
export interface DynamicMember extends AsyncIterable<RrValue[]> {
  /** Of a generator function an AsyncGenerator instead. */
  (...args: unknown[]): Promise<RrValue> & AsyncGenerator<RrValue, void, unknown>;
  /** A property's value; of an objref without index the object: `get<RemoteObject>()`. */
  get<T extends RrValue | RemoteObject = RrValue>(options?: CallOptions): Promise<T>;
  get(index: number | string, options?: CallOptions): Promise<RemoteObject>;
  set(value: unknown, options?: CallOptions): Promise<void>;
  on(listener: (...args: RrValue[]) => void): () => void;
  once(options?: CallOptions): Promise<RrValue[]>;
  handler: ((...args: RrValue[]) => unknown) | null;
  /** Of a wire the connection at once, of a pipe the promise of an endpoint. */
  connect(options?: CallOptions): WireConnection & Promise<PipeEndpoint>;
  connect(index: number, options?: PipeConnectOptions): Promise<PipeEndpoint>;
  peek(options?: CallOptions): Promise<RrValue>;
  peekOut(options?: CallOptions): Promise<RrValue>;
  poke(value: unknown, options?: CallOptions): Promise<void>;
  dimensions(options?: CallOptions): Promise<number[]>;
  read(
    position: number | readonly number[],
    count: number | readonly number[],
    options?: CallOptions,
  ): Promise<RrValue>;
  write(position: number | readonly number[], value: unknown, options?: CallOptions): Promise<void>;
}

/** Never there. What a compiler makes of a name of it tells whether it asks of each name whether it is there. */
declare const names: { readonly [name: string]: true };

/**
 * What stands behind a name where no names are known: `T`. With `noUncheckedIndexedAccess` it would be `T | undefined`, and each
 * call an error; `any` is the one type to which nothing is added.
 */
// eslint-disable-next-line @typescript-eslint/no-explicit-any
type ByName<T> = undefined extends true ? T : undefined extends typeof names.any ? any : T; // without strict: T

/**
 * A connected object: its members by name, and `$`. `RemoteObject<"Drive" | "Bump">` has these members alone; that also gives
 * them types where `noUncheckedIndexedAccess` is on, with which those of a plain RemoteObject are `any`.
 */
export type RemoteObject<M extends string = string> = { readonly $: ObjectInfo<RemoteObject<M>> } & {
  readonly [member in M]: string extends M ? ByName<DynamicMember> : DynamicMember;
};

type Commandable = ((...args: never[]) => Promise<unknown>) | { set: unknown } | { poke: unknown };
type UrgentCommand<M> = M extends (...args: never[]) => Promise<unknown>
  ? M
  : M extends { set: infer S } | { poke: infer S }
    ? S
    : never;

// eslint-disable-next-line @typescript-eslint/no-explicit-any
type AnyCommand = (...args: any[]) => Promise<unknown>;

/** The functions of `T`, and what writes its properties and wires. */
export type UrgentCommands<T> = string extends keyof T
  ? Readonly<Record<string, ByName<AnyCommand>>>
  : {
      readonly [K in keyof T as K extends "$" ? never : T[K] extends Commandable ? K : never]: UrgentCommand<T[K]>;
    };

/** The names of the members of `T` that are like `M`; of an object without known types every name. */
export type MembersLike<T, M> = string extends keyof T
  ? string
  : { [K in keyof T]: T[K] extends M ? K : never }[keyof T] & string;

export interface WireLike {
  connect(...args: never[]): { readonly ready: unknown } & AsyncIterable<unknown>;
}

export interface PipeLike {
  connect(...args: never[]): Promise<AsyncIterable<unknown>>;
}

export interface EventLike {
  on(listener: never): () => void;
}

export interface CallbackLike {
  handler: unknown;
}

/** What comes from the wire or pipe `K` of `T`. */
export type PacketOf<T, K> = string extends keyof T
  ? RrValue
  : K extends keyof T
    ? T[K] extends { connect(...args: never[]): infer C }
      ? Awaited<C> extends AsyncIterable<infer V>
        ? V
        : never
      : never
    : never;

/** The arguments of the event `K` of `T`. */
export type ArgumentsOf<T, K> = string extends keyof T
  ? RrValue[]
  : K extends keyof T
    ? T[K] extends EventMember<infer A>
      ? A
      : never
    : never;
