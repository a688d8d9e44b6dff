// Wires: the newest value wins. Layer: wasm-client/ts/members. Source: sessions spec section 2.12.
import { asyncDispose } from "../dispose.js";
import { makeError } from "../errors.js";
import type { CallOptions, Losses, RrValue, WireConnection, WireMember, WireTime } from "../types.js";
import { after, checkSignal } from "../within.js";
import { lossesOf } from "./member.js";
import type { MemberContext } from "./member.js";
import { ValueQueue } from "./queue.js";

export function makeWire(context: MemberContext): WireMember<unknown> {
  const { session, path, info } = context;
  const name = info.name;
  let shared: SharedWire | undefined;
  return Object.freeze({
    connect: (options = {}) => {
      checkSignal(options.signal);
      if (!shared || shared.isOver) shared = new SharedWire(context, (wire) => wire !== shared);
      return shared.join(options);
    },
    peek: async (options = {}) => session.request((core) => core.peekInValue(path, name), options),
    peekOut: async (options = {}) => session.request((core) => core.peekOutValue(path, name), options),
    poke: async (value: unknown, options = {}) => {
      await session.command(path, (core) => core.pokeOutValue(path, name, value), options);
    },
  } satisfies WireMember<unknown>);
}

/**
 * The protocol knows one connection a wire and session: all connections of the application share it. The first one
 * makes it, the last one that closes ends it.
 */
class SharedWire {
  isOver = false;
  value: RrValue | undefined;
  time: WireTime | undefined;
  readonly ready: Promise<void>;
  readonly #members = new Set<Connection>();
  readonly #stopListening: () => void;
  readonly #stopClosing: () => void;
  #isConnected = false;

  /** @param isReplaced  whether a newer connection of the same wire has been asked for meanwhile */
  constructor(
    readonly context: MemberContext,
    isReplaced: (wire: SharedWire) => boolean,
  ) {
    const { session, path, info } = context;
    this.#stopListening = session.listen(path, info.name, {
      onWireValue: (value, seconds, nanoseconds) => {
        this.value = value;
        this.time = { seconds, nanoseconds };
        for (const member of [...this.#members]) member.receive(value);
      },
      onWireClosed: () => this.#end(),
    });
    this.#stopClosing = session.onClose((reason) => this.#end(reason));
    this.ready = session
      .request((core) => core.connectWire(path, info.name))
      .then(
        () => {
          this.#isConnected = true;
          // Nobody wants it any more; with a newer one the service and the core have but one connection.
          if (this.isOver && !isReplaced(this)) void this.#disconnect();
        },
        (error: unknown) => {
          this.#end(error);
          throw error;
        },
      );
    this.ready.catch(() => undefined); // whoever waits for it hears of it
  }

  join(options: CallOptions): WireConnection {
    const connection = new Connection(this, options);
    this.#members.add(connection);
    return connection;
  }

  /** Resolves when the service knows, if this was the last one. */
  async leave(connection: Connection): Promise<void> {
    this.#members.delete(connection);
    if (this.#members.size > 0 || this.isOver) return;
    this.#over();
    if (this.#isConnected) await this.#disconnect();
  }

  async send(value: unknown): Promise<void> {
    await this.ready;
    const { session, path, info } = this.context;
    if (this.isOver) throw closedWire(info.name);
    await session.tell((core) => core.sendWire(path, info.name, value));
  }

  #over(): void {
    this.isOver = true;
    this.#stopListening();
    this.#stopClosing();
  }

  #end(reason?: unknown): void {
    if (this.isOver) return;
    this.#over();
    const members = [...this.#members];
    this.#members.clear();
    for (const member of members) member.end(reason);
  }

  /** A wire that is gone already needs no leave; nothing waits for the answer but close(). */
  async #disconnect(): Promise<void> {
    const { session, path, info } = this.context;
    if (session.isClosed) return;
    await session.request((core) => core.disconnectWire(path, info.name)).catch(() => undefined);
  }
}

class Connection implements WireConnection {
  readonly ready: Promise<void>;
  readonly #loops = new Set<ValueQueue<RrValue>>();
  #end: { reason?: unknown } | undefined;
  #value: RrValue | undefined;
  #time: WireTime | undefined;
  #abort: (() => void) | undefined;

  constructor(
    private readonly wire: SharedWire,
    { signal, timeout }: CallOptions,
  ) {
    this.ready = this.#limited(signal, timeout);
    this.ready.catch(() => undefined);
    this.#value = wire.value;
    this.#time = wire.time;
  }

  get value(): RrValue | undefined {
    return this.#value;
  }

  get time(): WireTime | undefined {
    return this.#time;
  }

  [Symbol.asyncIterator](): AsyncIterator<RrValue, undefined> {
    const queue = new ValueQueue<RrValue>(1, () => {
      this.#loops.delete(queue);
      void this.close();
    });
    if (this.#value !== undefined) queue.push(this.#value);
    if (this.#end) finish(queue, this.#end);
    else this.#loops.add(queue);
    return queue;
  }

  send(value: unknown): Promise<void> {
    if (!this.#end) return this.wire.send(value);
    const reason: unknown = this.#end.reason ?? closedWire(this.wire.context.info.name);
    return Promise.reject(reason);
  }

  losses(options?: CallOptions): Promise<Losses | undefined> {
    return lossesOf(this.wire.context, options);
  }

  [asyncDispose](): Promise<void> {
    return this.close();
  }

  close(): Promise<void> {
    if (this.#end) return Promise.resolve();
    this.end();
    return this.wire.leave(this);
  }

  // --- for SharedWire ---

  receive(value: RrValue): void {
    this.#value = value;
    this.#time = this.wire.time;
    for (const loop of [...this.#loops]) loop.push(value);
  }

  end(reason?: unknown): void {
    if (this.#end) return;
    this.#abort?.();
    this.#end = reason === undefined ? {} : { reason };
    for (const loop of this.#loops) finish(loop, this.#end);
    this.#loops.clear();
  }

  /** The shared connection's `ready`, within the limits of this one. */
  #limited(signal: AbortSignal | undefined, timeout: number | undefined): Promise<void> {
    return new Promise((resolve, reject) => {
      const giveUp = (reason: unknown) => {
        reject(reason);
        if (this.#end) return;
        this.end(reason);
        void this.wire.leave(this);
      };
      const abort = () => giveUp(signal?.reason);
      const timer = after(timeout, () => {
        const name = this.wire.context.info.name;
        giveUp(makeError("RequestTimeout", `wire ${name} was not connected within ${timeout} ms`));
      });
      this.#abort = () => {
        clearTimeout(timer);
        signal?.removeEventListener("abort", abort);
      };
      this.wire.ready.then(() => (clearTimeout(timer), resolve()), reject);
      if (signal?.aborted) queueMicrotask(abort);
      else signal?.addEventListener("abort", abort, { once: true });
    });
  }
}

function finish(queue: ValueQueue<RrValue>, end: { reason?: unknown }): void {
  if (end.reason === undefined) queue.end();
  else queue.fail(end.reason);
}

const closedWire = (name: string) => makeError("InvalidOperation", `wire ${name} is closed`);
