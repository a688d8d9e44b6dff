// The part of `rrgate-client` that this page uses, by name: members appear only at run time, so they are looked up
// and checked here, once, instead of being cast all over the pages.
// Layer: web/robot. The only file that imports `rrgate-client`.

import { connect, RobotRaconteurError } from "rrgate-client";

export type MemberKind = "property" | "function" | "event" | "objref" | "pipe" | "callback" | "wire" | "memory";

export interface Parameter {
  name: string;
  type: string;
}

export interface Member {
  name: string;
  kind: MemberKind;
  /** Value type; for functions the return type, for objrefs the target with its index. */
  type: string;
  parameters: Parameter[];
  modifiers: string[];
}

/** A connected object of a device. */
export interface Remote {
  /** Qualified object type, such as `experimental.create.Create`. */
  readonly type: string;
  readonly members: readonly Member[];
  has(name: string, kind: MemberKind): boolean;
  call(name: string, args: readonly unknown[]): Promise<unknown>;
  get(name: string): Promise<unknown>;
  set(name: string, value: unknown): Promise<void>;
  /** Values of a wire from now on, the newest only; ends with the connection or with `signal`. */
  wire(name: string, signal: AbortSignal): AsyncGenerator<unknown, void>;
  poke(name: string, value: unknown): Promise<void>;
  /** @returns a function that unsubscribes. */
  on(name: string, heard: (...args: unknown[]) => void): () => void;
  child(name: string, index?: string | number): Promise<Remote>;
  on_close(heard: (reason: string) => void): void;
  close(): void;
}

/** Opens a service. @throws Error with a sentence for people; see `explain` for the names behind it. */
export async function open_remote(url: string, signal: AbortSignal): Promise<Remote> {
  return wrap((await connect(url, { signal, timeout: 10_000 })) as unknown as Raw);
}

/** One sentence for any failure; errors of a device keep the name of their Robot Raconteur exception. */
export function explain(error: unknown): string {
  if (error instanceof RobotRaconteurError) {
    const name = error.subName ? `${error.name} (${error.subName})` : error.name;
    return error.message ? `${name}: ${error.message}` : name;
  }
  return error instanceof Error ? error.message : String(error);
}

interface RawInfo {
  type: string;
  members: readonly Member[];
  onClose(heard: (error?: unknown) => void): unknown;
  close(): unknown;
}

type Raw = { readonly $: RawInfo } & Record<string, unknown>;

function wrap(raw: Raw): Remote {
  const info = raw.$;
  const member = <T>(name: string): T => {
    if (!info.members.some((m) => m.name === name)) throw new Error(`${info.type} has no member "${name}"`);
    return raw[name] as T;
  };
  return {
    type: info.type,
    members: info.members,
    has: (name, kind) => info.members.some((m) => m.name === name && m.kind === kind),
    call: async (name, args) => member<(...args: unknown[]) => Promise<unknown>>(name)(...args),
    get: async (name) => member<{ get(): Promise<unknown> }>(name).get(),
    set: async (name, value) => member<{ set(v: unknown): Promise<void> }>(name).set(value),
    wire: (name, signal) => wire_values(member<{ connect(): AsyncIterable<unknown> }>(name).connect(), signal),
    poke: async (name, value) => member<{ poke(v: unknown): Promise<void> }>(name).poke(value),
    on: (name, heard) => member<{ on(f: (...args: unknown[]) => void): () => void }>(name).on(heard),
    child: async (name, index) => wrap(await member<{ get(i?: string | number): Promise<Raw> }>(name).get(index)),
    on_close: (heard) => void info.onClose((error) => heard(error === undefined ? "the connection was closed" : explain(error))),
    close: () => void info.close(),
  };
}

async function* wire_values(source: AsyncIterable<unknown>, signal: AbortSignal): AsyncGenerator<unknown, void> {
  const values = source[Symbol.asyncIterator]();
  const stop = () => void values.return?.();
  signal.addEventListener("abort", stop, { once: true });
  try {
    while (!signal.aborted) {
      const next = await values.next();
      if (next.done || signal.aborted) return;
      yield next.value;
    }
  } finally {
    signal.removeEventListener("abort", stop);
    stop();
  }
}
