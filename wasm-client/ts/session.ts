// Drives the core: bytes in and out, timers, and which promise a request belongs to. Layer: wasm-client/ts.
import { call_safely, connection_lost, ErrorCode, make_error, RobotRaconteurError, text_of } from "./errors.js";
import type { ErrorFields } from "./errors.js";
import type { Transport } from "./transport.js";
import type { CallOptions, RrValue } from "./types.js";
import type { Core, CoreEvent } from "./wasm_module.js";
import { check_signal } from "./within.js";

/** Above this many bytes in the transport, the core keeps what it has: there newer wire values replace older ones. */
const high_mark = 256 * 1024;
/** WebSockets do not say when they have room again. */
const drain_poll_ms = 10;
const longest_timer_ms = 2 ** 31 - 1;

interface Pending {
  resolve(value: RrValue): void;
  reject(reason: unknown): void;
}

/** What a member hears of, besides the answers to its requests. */
export interface MemberListener {
  on_event?(args: RrValue[]): void;
  on_wire_value?(value: RrValue, seconds: number, nanoseconds: number): void;
  on_wire_closed?(): void;
  on_pipe_packet?(index: number, value: RrValue): void;
  on_pipe_acks?(index: number, numbers: number[]): void;
  on_pipe_closed?(index: number): void;
}

export type CallbackHandler = (...args: RrValue[]) => unknown;

export class Session {
  /** Set by close(), or by whatever ended the session. */
  #end: { reason: RobotRaconteurError; is_local: boolean } | undefined;
  #was_connected = false;
  #is_closed = false;
  #is_pumping = false;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #timer_at = Infinity;
  readonly #pending = new Map<number, Pending>();
  /** Those that wait for room. */
  #senders: { resolve(): void; reject(reason: unknown): void }[] = [];
  readonly #listeners = new Map<string, Set<MemberListener>>();
  readonly #handlers = new Map<string, CallbackHandler>();
  readonly #closers = new Set<(reason?: RobotRaconteurError) => void>();
  readonly #release_listeners = new Set<(path: string) => void>();
  readonly #connected: Promise<string>;
  #settle_connected!: { resolve(type: string): void; reject(reason: unknown): void };
  readonly #closed: Promise<void>;
  #settle_closed!: () => void;

  /** `transport` is open; `timeout`: of requests that bring none, in milliseconds. */
  constructor(
    private readonly core: Core,
    private readonly transport: Transport,
    private readonly timeout: number,
  ) {
    this.#connected = new Promise((resolve, reject) => (this.#settle_connected = { resolve, reject }));
    this.#connected.catch(() => undefined); // whoever waits for it hears of it
    this.#closed = new Promise((resolve) => (this.#settle_closed = resolve));
  }

  /** Begins the handshake. Resolves with the root object's type. */
  start(): Promise<string> {
    this.#pump();
    return this.#connected;
  }

  get is_closed(): boolean {
    return this.#end !== undefined;
  }

  // --- the transport's news ---

  received(bytes: Uint8Array): void {
    if (this.#is_closed) return;
    this.#guarded(() => this.core.handle_bytes(bytes));
    this.#pump();
  }

  /** The stream is gone. */
  lost(reason: string): void {
    if (this.#is_closed) return;
    this.#guarded(() => this.core.handle_closed(reason));
    this.#pump();
  }

  // --- requests ---

  /**
   * @param ask   makes the request in the core and returns its number.
   * @param done  called with the value before anything else is heard of; the promise follows later.
   */
  request(ask: (core: Core) => number, options: CallOptions = {}, done?: (value: RrValue) => void): Promise<RrValue> {
    const { signal } = options;
    return new Promise((resolve, reject) => {
      check_signal(signal);
      if (signal?.aborted) return reject(signal.reason);
      if (this.#end) return reject(this.#end.reason);
      this.core.set_request_timeout(check_timeout(options.timeout ?? this.timeout));
      const id = ask(this.core);
      const abort = () => {
        this.#pending.delete(id);
        if (!this.#is_closed) this.core.cancel(id);
        reject(signal?.reason);
      };
      const forget = () => signal?.removeEventListener("abort", abort);
      this.#pending.set(id, {
        resolve: (value) => (forget(), done?.(value), resolve(value)),
        reject: (reason) => (forget(), reject(reason)),
      });
      signal?.addEventListener("abort", abort, { once: true });
      this.#pump();
    });
  }

  /** Something without an answer. @throws RobotRaconteurError */
  tell<T>(what: (core: Core) => T): T {
    if (this.#end) throw this.#end.reason;
    const result = what(this.core);
    this.#pump();
    return result;
  }

  /** Nothing where there is room for more to send; else what resolves when there is. */
  room(): Promise<void> | undefined {
    if (this.#end || this.#has_room()) return undefined;
    return new Promise((resolve, reject) => this.#senders.push({ resolve, reject }));
  }

  /** Something that sends nothing; undefined once the session is over. */
  look<T>(at: (core: Core) => T): T | undefined {
    return this.#is_closed ? undefined : at(this.core);
  }

  // --- listeners ---

  /** @returns a function that ends it. */
  listen(path: string, member: string, listener: MemberListener): () => void {
    const key = `${path} ${member}`;
    let listeners = this.#listeners.get(key);
    if (!listeners) this.#listeners.set(key, (listeners = new Set()));
    listeners.add(listener);
    return () => {
      listeners.delete(listener);
      if (listeners.size === 0 && this.#listeners.get(key) === listeners) this.#listeners.delete(key);
    };
  }

  /** Who answers a callback; null for nobody. One for all objects of a path: the last one that is set. */
  set_handler(path: string, member: string, handler: CallbackHandler | null): void {
    const key = `${path} ${member}`;
    if (handler) this.#handlers.set(key, handler);
    else this.#handlers.delete(key);
  }

  handler(path: string, member: string): CallbackHandler | null {
    return this.#handlers.get(`${path} ${member}`) ?? null;
  }

  on_release(released: (path: string) => void): () => void {
    this.#release_listeners.add(released);
    return () => void this.#release_listeners.delete(released);
  }

  /** Calls once, when the session has ended; soon, if it has already. */
  on_close(closed: (reason?: RobotRaconteurError) => void): () => void {
    if (this.#is_closed) {
      let is_wanted = true;
      queueMicrotask(() => is_wanted && this.#tell_closed(closed));
      return () => void (is_wanted = false);
    }
    this.#closers.add(closed);
    return () => void this.#closers.delete(closed);
  }

  // --- the end ---

  /** Takes leave of the service; what waits for an answer rejects at once. */
  close(): Promise<void> {
    if (!this.#end) {
      this.#end = { reason: make_error("ConnectionError", "the session was closed by this side"), is_local: true };
      this.#reject_pending(this.#end.reason);
      this.#guarded(() => this.core.disconnect());
      this.#pump();
    }
    return this.#closed;
  }

  #reject_pending(reason: RobotRaconteurError): void {
    const waiting = [...this.#pending.values()];
    this.#pending.clear();
    this.#settle_connected.reject(reason);
    for (const { reject } of waiting) reject(reason);
    for (const { reject } of this.#senders.splice(0)) reject(reason);
  }

  #finish(reason: RobotRaconteurError): void {
    if (this.#is_closed) return;
    this.#end ??= { reason, is_local: false };
    this.#is_closed = true;
    clearTimeout(this.#timer);
    this.#reject_pending(this.#end.reason);
    this.transport.close();
    const closers = [...this.#closers];
    this.#closers.clear();
    this.#listeners.clear();
    this.#release_listeners.clear();
    this.#handlers.clear();
    for (const closed of closers) this.#tell_closed(closed);
    this.#settle_closed();
  }

  #tell_closed(closed: (reason?: RobotRaconteurError) => void): void {
    const end = this.#end;
    call_safely(() => (end && !end.is_local ? closed(end.reason) : closed()));
  }

  // --- the pump: after whatever was told or asked, poll until nothing is left ---

  #pump(): void {
    if (this.#is_pumping || this.#is_closed) return; // a listener asked something: the loop below goes on with it
    this.#is_pumping = true;
    this.#guarded(() => {
      for (;;) {
        this.#transmit();
        const event = this.core.poll_event();
        if (!event) break;
        this.#dispatch(event);
        if (this.#is_closed) break;
      }
    });
    this.#is_pumping = false;
    if (this.#is_closed) return;
    if (this.#senders.length > 0 && this.#has_room()) for (const { resolve } of this.#senders.splice(0)) resolve();
    this.#arm_timer();
  }

  #has_room(): boolean {
    return this.transport.buffered < high_mark && this.core.queued_bytes() < high_mark;
  }

  #transmit(): void {
    while (this.transport.buffered < high_mark) {
      const bytes = this.core.poll_transmit();
      if (!bytes) return;
      this.transport.send(bytes);
      this.core.handle_transmitted(bytes.length);
    }
  }

  #dispatch(event: CoreEvent): void {
    switch (event.kind) {
      case "connected":
        this.#was_connected = true;
        this.#settle_connected.resolve(event.type);
        break;
      case "completed":
        this.#take_pending(event.id)?.resolve(event.value);
        break;
      case "failed":
        this.#take_pending(event.id)?.reject(this.#error(event.error));
        break;
      case "event":
        this.#tell(event.path, event.member, (listener) => listener.on_event?.(event.arguments));
        break;
      case "wire":
        this.#tell(event.path, event.member, (listener) =>
          listener.on_wire_value?.(event.value, event.seconds, event.nanoseconds),
        );
        break;
      case "wire_closed":
        this.#tell(event.path, event.member, (listener) => listener.on_wire_closed?.());
        break;
      case "pipe":
        this.#tell(event.path, event.member, (listener) => listener.on_pipe_packet?.(event.index, event.value));
        break;
      case "pipe_acks":
        this.#tell(event.path, event.member, (listener) => listener.on_pipe_acks?.(event.index, event.numbers));
        break;
      case "pipe_closed":
        this.#tell(event.path, event.member, (listener) => listener.on_pipe_closed?.(event.index));
        break;
      case "callback":
        void this.#answer(event);
        break;
      case "path_released":
        for (const key of this.#handlers.keys()) {
          const [path] = key.split(" ", 1) as [string];
          if (path === event.path || path.startsWith(`${event.path}.`)) this.#handlers.delete(key);
        }
        for (const released of [...this.#release_listeners]) call_safely(() => released(event.path));
        break;
      case "closed":
        this.#finish(this.#error(event.error));
        break;
    }
  }

  /** A connection that was up and is no more has a mark of its own: what was under way may have been carried out. */
  #error(fields: ErrorFields): RobotRaconteurError {
    const is_loss = this.#was_connected && fields.code === ErrorCode.ConnectionError && this.core.wants_close();
    return new RobotRaconteurError(is_loss ? { ...fields, subName: fields.subName || connection_lost } : fields);
  }

  /** Asks the handler of a callback, and tells the service what it said. */
  async #answer({ id, path, member, arguments: args }: CoreEvent & { kind: "callback" }): Promise<void> {
    try {
      const handler = this.#handlers.get(`${path} ${member}`);
      if (!handler) throw make_error("InvalidOperation", "Callback function not set");
      const value = await handler(...args);
      if (this.#end) return;
      // A value that does not fit is this side's mistake: whoever wrote the handler should see it, too.
      call_safely(() => this.tell((core) => core.reply_callback(id, path, member, value)));
    } catch (error) {
      if (!this.#end) this.tell((core) => core.fail_callback(id, error_fields(error)));
    }
  }

  #take_pending(id: number): Pending | undefined {
    const pending = this.#pending.get(id);
    this.#pending.delete(id);
    return pending;
  }

  #tell(path: string, member: string, what: (listener: MemberListener) => void): void {
    const listeners = this.#listeners.get(`${path} ${member}`);
    if (!listeners) return;
    for (const listener of [...listeners]) call_safely(() => what(listener));
  }

  #arm_timer(): void {
    const is_held_back = this.transport.buffered >= high_mark;
    const due = is_held_back ? performance.now() + drain_poll_ms : this.core.poll_timeout();
    if (due >= this.#timer_at) return; // the running timer looks again when it fires
    clearTimeout(this.#timer);
    this.#timer_at = due;
    // Rounded up: a timer that fires early would only be set anew.
    const delay = Math.min(Math.max(Math.ceil(due - performance.now()), 0), longest_timer_ms);
    this.#timer = setTimeout(() => {
      this.#timer_at = Infinity;
      if (this.#is_closed) return;
      this.#guarded(() => this.core.handle_timeout());
      this.#pump();
    }, delay);
  }

  /** An exception here is a trap in the core (memory at its end) or a broken transport: the session is over. */
  #guarded(what: () => void): void {
    try {
      what();
    } catch (error) {
      this.#finish(make_error("InternalError", `the session failed: ${text_of(error)}`));
    }
  }
}

/** What a service hears of an exception: errors of the protocol as they are, others by name, as from Python. */
function error_fields(error: unknown): Partial<ErrorFields> {
  if (error instanceof RobotRaconteurError) {
    const { code, name, message, subName } = error;
    return { code, name, message, subName };
  }
  if (error instanceof Error) return { code: ErrorCode.UnknownError, name: error.name, message: error.message };
  return { code: ErrorCode.UnknownError, message: String(error) };
}

/** @throws RobotRaconteurError InvalidArgument */
export function check_timeout(milliseconds: number, name = "timeout"): number {
  if (milliseconds > 0) return milliseconds;
  throw make_error("InvalidArgument", `${name} ${String(milliseconds)}: expected milliseconds above 0`);
}
