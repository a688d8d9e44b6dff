// Wires: the newest value wins. Layer: wasm-client/ts/members. Source: sessions spec section 2.12.
import { make_error } from "../errors.js";
import type { CallOptions, Losses, RrValue, WireConnection, WireMember, WireTime } from "../types.js";
import { check_signal } from "../within.js";
import { losses_of } from "./losses.js";
import type { MemberContext } from "./member.js";
import { ValueQueue } from "./queue.js";

export function make_wire(context: MemberContext): WireMember<unknown> {
  const { session, path, info } = context;
  const name = info.name;
  let shared: SharedWire | undefined;
  return Object.freeze({
    connect: (options = {}) => {
      check_signal(options.signal);
      if (!shared || shared.is_over) shared = new SharedWire(context);
      return shared.join(options);
    },
    peek: async (options = {}) => session.request((core) => core.peek_in_value(path, name), options),
    peekOut: async (options = {}) => session.request((core) => core.peek_out_value(path, name), options),
    poke: async (value: unknown, options = {}) => {
      await session.request((core) => core.poke_out_value(path, name, value), options);
    },
  } satisfies WireMember<unknown>);
}

/**
 * The protocol knows one connection a wire and session: all connections of the application share it. The first one
 * makes it, the last one that closes ends it.
 */
class SharedWire {
  is_over = false;
  value: RrValue | undefined;
  time: WireTime | undefined;
  readonly ready: Promise<void>;
  readonly #members = new Set<Connection>();
  readonly #stop_listening: () => void;
  readonly #stop_closing: () => void;
  #is_connected = false;

  constructor(readonly context: MemberContext) {
    const { session, path, info } = context;
    this.#stop_listening = session.listen(path, info.name, {
      on_wire_value: (value, seconds, nanoseconds) => {
        this.value = value;
        this.time = { seconds, nanoseconds };
        for (const member of [...this.#members]) member.receive(value);
      },
      on_wire_closed: () => this.#end(),
    });
    this.#stop_closing = session.on_close((reason) => this.#end(reason));
    this.ready = session
      .request((core) => core.connect_wire(path, info.name))
      .then(
        () => {
          this.#is_connected = true;
          if (this.is_over) this.#disconnect();
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
    if (this.#members.size > 0 || this.is_over) return;
    this.#over();
    if (this.#is_connected) await this.#disconnect();
  }

  async send(value: unknown): Promise<void> {
    await this.ready;
    const { session, path, info } = this.context;
    if (this.is_over) throw closed_wire(info.name);
    session.tell((core) => core.send_wire(path, info.name, value));
  }

  #over(): void {
    this.is_over = true;
    this.#stop_listening();
    this.#stop_closing();
  }

  #end(reason?: unknown): void {
    if (this.is_over) return;
    this.#over();
    const members = [...this.#members];
    this.#members.clear();
    for (const member of members) member.end(reason);
  }

  /** A wire that is gone already needs no leave; nothing waits for the answer but close(). */
  async #disconnect(): Promise<void> {
    const { session, path, info } = this.context;
    if (session.is_closed) return;
    await session.request((core) => core.disconnect_wire(path, info.name)).catch(() => undefined);
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
    if (this.#end) return Promise.reject(this.#end.reason ?? closed_wire(this.wire.context.info.name));
    return this.wire.send(value);
  }

  losses(options?: CallOptions): Promise<Losses | undefined> {
    return losses_of(this.wire.context, options);
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
      const give_up = (reason: unknown) => {
        reject(reason);
        if (this.#end) return;
        this.end(reason);
        void this.wire.leave(this);
      };
      const abort = () => give_up(signal?.reason);
      const timer =
        timeout === undefined
          ? undefined
          : setTimeout(() => {
              const name = this.wire.context.info.name;
              give_up(make_error("RequestTimeout", `wire ${name} was not connected within ${timeout} ms`));
            }, timeout);
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

const closed_wire = (name: string) => make_error("InvalidOperation", `wire ${name} is closed`);
