// The part of `rrgate-client` that this page uses, by name: members appear only at run time, so they are looked up
// and checked here, once, instead of being cast all over the pages.
// Layer: web/robot. Others import of `rrgate-client` at most its errors, types of varvalues, subscriptions, leases and USB devices.

import { lease, RobotRaconteurError } from "rrgate-client";
import type {
  CallOptions,
  DynamicMember,
  Lease,
  LeaseOptions,
  MemberInfo,
  MemberKind,
  RemoteObject,
  WireConnection,
} from "rrgate-client";

import type { Control } from "./control";
import { OwnLocks } from "./own_locks";
import { UnderWay } from "./under_way";

export type Member = MemberInfo;
export type { MemberKind };

/** Of the values of one connection, by the service. */
export type Account = Pick<WireConnection, "losses">;

/** A connected object of a device. */
export interface Remote {
  /** The gateway's name of the device. */
  readonly device: string;
  /** Qualified object type, such as `experimental.create.Create`. */
  readonly type: string;
  /** Such as `Create` or `Webcam.Webcams[0]`. */
  readonly path: string;
  readonly members: readonly Member[];
  /** The texts of the definitions known so far. */
  readonly definitions: readonly string[];
  /** Commands of this connection that are not answered yet. */
  readonly underWay: UnderWay;
  /** By path, the newest of each object of the service: they outlive the connection. */
  readonly controls: Map<string, Control>;
  /** Of all objects of the session. */
  readonly locks: OwnLocks;
  has(name: string, kind: MemberKind): boolean;
  call(name: string, args: readonly unknown[], options?: CallOptions): Promise<unknown>;
  /** Past whatever waits to be sent. @throws (rejects) where `name` is no function, or one that only begins a generator. */
  urgent(name: string, args: readonly unknown[], options?: CallOptions): Promise<unknown>;
  /** The right to command the object. @throws (rejects) NotImplementedError where nobody gives any. */
  lease(options: LeaseOptions): Promise<Lease>;
  get(name: string): Promise<unknown>;
  set(name: string, value: unknown, options?: CallOptions): Promise<void>;
  /** Writes a property, or pokes a wire, past whatever waits to be sent. */
  setNow(name: string, value: unknown, options?: CallOptions): Promise<void>;
  /** Values of a wire from now on, the newest only; ends with the connection or with `signal`. `opened`: what tells of them. */
  wire(name: string, signal: AbortSignal, opened?: (account: Account) => void): AsyncGenerator<unknown, void>;
  poke(name: string, value: unknown, options?: CallOptions): Promise<void>;
  /** All packets of a new pipe endpoint; ends when the device closes it, with the connection or with `signal`. */
  pipe(name: string, signal: AbortSignal, opened?: (account: Account) => void): AsyncGenerator<unknown, void>;
  /** Items of a memory in each dimension. */
  dimensions(memory: string): Promise<number[]>;
  read(memory: string, position: readonly number[], count: readonly number[]): Promise<unknown>;
  write(memory: string, position: readonly number[], value: unknown): Promise<void>;
  /** An endpoint to send with; what it receives is dropped. */
  openPipe(name: string): Promise<Sender>;
  /** A run of a generator function. */
  generate(name: string, args: readonly unknown[]): AsyncGenerator<unknown, void, unknown>;
  lock(kind: "user" | "client"): Promise<void>;
  unlock(): Promise<void>;
  /** Asks the device for something small: whether it still answers. @returns false where the object has nothing small, so that nothing was asked. */
  ping(timeoutMs: number): Promise<boolean>;
  /** Answers a callback by `handler`. @returns a function that stops answering. */
  answer(name: string, handler: (...args: unknown[]) => unknown): () => void;
  /** @returns a function that unsubscribes. */
  on(name: string, heard: (...args: unknown[]) => void): () => void;
  child(name: string, index?: string | number): Promise<Remote>;
  /** Calls once when the device has put another object in the place of this one: it must be looked up again. @returns a function that hears no more. */
  onReleased(released: () => void): () => void;
}

export interface Sender {
  readonly isClosed: boolean;
  send(value: unknown): Promise<void>;
  close(): Promise<void>;
}

/** One sentence for any failure; errors of a device keep the name of their Robot Raconteur exception. */
export function explain(error: unknown): string {
  if (error instanceof RobotRaconteurError) {
    const name = error.subName ? `${error.name} (${error.subName})` : error.name;
    return error.message ? `${name}: ${error.message}` : name;
  }
  return error instanceof Error ? error.message : String(error);
}

type Command = (...args: unknown[]) => Promise<unknown>;

/** The last step's type, or that of the last argument, says that it is a generator. */
export function isGenerator({ type, parameters }: Pick<Member, "type" | "parameters">): boolean {
  return [type, parameters.at(-1)?.type ?? ""].some((each) => each.endsWith("{generator}"));
}

export function remoteOf(
  object: RemoteObject,
  device = "",
  controls = new Map<string, Control>(),
  locks = new OwnLocks(),
  underWay = new UnderWay(),
): Remote {
  const info = object.$;
  // By name through `$`: a definition may call a member "then" or "toString".
  const member = (name: string): DynamicMember => {
    if (!info.members.some((m) => m.name === name)) throw new Error(`${info.type} has no member "${name}"`);
    return info.member(name);
  };
  const children = new WeakMap<RemoteObject, Remote>(); // who asks for one again gets the same: what is known of it is kept by it
  return {
    device,
    type: info.type,
    path: info.path,
    members: info.members,
    get definitions() {
      return info.types;
    },
    has: (name, kind) => info.members.some((m) => m.name === name && m.kind === kind),
    underWay,
    controls,
    locks,
    call: (name, args, options) =>
      underWay.follow((async () => member(name)(...args, ...(options ? [options] : [])))()),
    urgent: async (name, args, options) => {
      const declared = info.members.find((each) => each.name === name);
      const isCallable = declared?.kind === "function" && !isGenerator(declared);
      const urgent = isCallable ? (info.urgent[name] as Command | undefined) : undefined;
      if (!urgent) throw new Error(`${info.type} has no function "${name}" that can be called at once`);
      return urgent(...args, ...(options ? [options] : []));
    },
    lease: async (options) => lease(object, options),
    get: async (name) => member(name).get(),
    set: (name, value, options) => underWay.follow((async () => member(name).set(value, options))()),
    setNow: async (name, value, options) => {
      const write = info.urgent[name] as Command | undefined;
      if (!write) throw new Error(`${info.type} has no property or wire "${name}" that can be written at once`);
      await write(value, ...(options ? [options] : []));
    },
    wire: (name, signal, opened) => valuesOf(() => member(name).connect({ signal }), signal, opened),
    pipe: (name, signal, opened) => valuesOf(() => member(name).connect(-1, { signal }), signal, opened),
    dimensions: async (name) => member(name).dimensions(),
    read: async (name, position, count) => member(name).read(position, count),
    write: async (name, position, value) => member(name).write(position, value),
    openPipe: async (name) => {
      const endpoint = await member(name).connect(-1, {});
      void drop(endpoint).catch(() => undefined); // who sends hears that it is closed
      return endpoint;
    },
    generate: (name, args) => member(name)(...args),
    lock: async (kind) => {
      await info.lock(kind);
      locks.add(info.path, () => info.unlock());
    },
    unlock: async () => {
      await info.unlock();
      locks.delete(info.path);
    },
    ping: async (timeout) => {
      const small = smallest(info.members);
      if (small?.kind === "wire") await member(small.name).peek({ timeout });
      else if (small) await member(small.name).get({ timeout });
      return small !== undefined;
    },
    answer: (name, handler) => {
      const callback = member(name);
      callback.handler = handler;
      return () => void (callback.handler = null);
    },
    poke: (name, value, options) => underWay.follow((async () => member(name).poke(value, options))()),
    on: (name, heard) => member(name).on(heard),
    onReleased: (released) => info.onClose(() => info.state === "released" && released()),
    child: async (name, index) => {
      const found = await (index === undefined ? member(name).get<RemoteObject>() : member(name).get(index));
      const child = children.get(found) ?? remoteOf(found, device, controls, locks, underWay);
      children.set(found, child);
      return child;
    },
  };
}

/** A wire to peek at, or a property to read, whose value is a word. */
function smallest(members: readonly Member[]): Member | undefined {
  const readable = members.filter(({ modifiers }) => !modifiers.includes("writeonly"));
  const words = readable.filter(({ type }) => /^(double|single|bool|u?int(8|16|32|64)|\w*[mM]ode)$/.test(type));
  return (
    words.find(({ kind }) => kind === "property") ??
    words.find(({ kind }) => kind === "wire") ??
    readable.find(({ kind }) => kind === "wire")
  );
}

/** An endpoint that nobody reads would keep all packets, and be closed when they are too many. */
async function drop(packets: AsyncIterable<unknown>): Promise<void> {
  for await (const _ of packets);
}

type Stream = AsyncIterable<unknown> & Account;

/** Leaving the loop, or `signal`, closes the wire's connection or the pipe's endpoint. */
async function* valuesOf(
  open: () => Stream | Promise<Stream>,
  signal: AbortSignal,
  opened?: (account: Account) => void,
): AsyncGenerator<unknown, void> {
  const stream = await open();
  opened?.(stream);
  const values = stream[Symbol.asyncIterator]();
  const stop = (): void => void values.return?.()?.catch(() => undefined); // closing what is already gone
  signal.addEventListener("abort", stop, { once: true });
  try {
    while (!signal.aborted) {
      const next = await values.next();
      if (next.done || signal.aborted) return;
      yield next.value;
    }
  } catch (error) {
    if (!signal.aborted) throw error;
  } finally {
    signal.removeEventListener("abort", stop);
    stop();
  }
}
