// Drives the core: bytes in and out, timers, and which promise a request belongs to. Layer: wasm-client/ts.
import {
  callSafely,
  connectionLost,
  ErrorCode,
  errorFields,
  makeError,
  RobotRaconteurError,
  textOf,
} from "./errors.js";
import type { ErrorFields } from "./errors.js";
import { lookTimer, roomMark, transmit } from "./outflow.js";
import type { LookTimer } from "./outflow.js";
import type { Transport } from "./transport.js";
import type { CallOptions, RrValue } from "./types.js";
import type { Core, CoreEvent } from "./wasm_module.js";
import { checkSignal } from "./within.js";

interface Pending {
  resolve(value: RrValue): void;
  reject(reason: unknown): void;
}

/** What a member hears of, besides the answers to its requests. */
export interface MemberListener {
  onEvent?(args: RrValue[]): void;
  onWireValue?(value: RrValue, seconds: number, nanoseconds: number): void;
  onWireClosed?(): void;
  onPipePacket?(index: number, value: RrValue): void;
  onPipeAcks?(index: number, numbers: number[]): void;
  /** `reason`: where it was not the service that closed it. */
  onPipeClosed?(index: number, reason?: RobotRaconteurError): void;
}

export type CallbackHandler = (...args: RrValue[]) => unknown;

export class Session {
  /** Set by close(), or by whatever ended the session. */
  #isBroken = false;
  #end: { reason: RobotRaconteurError; isLocal: boolean } | undefined;
  #wasConnected = false;
  #isClosed = false;
  #isPumping = false;
  #isUrgent = false;
  /** What time commands of an object have, where a lease says so. */
  timeoutAt?: ((path: string) => number | undefined) | undefined;
  readonly #timer: LookTimer;
  readonly #pending = new Map<number, Pending>();
  /** Those that wait for room. */
  #senders: { resolve(): void; reject(reason: unknown): void }[] = [];
  readonly #listeners = new Map<string, Set<MemberListener>>();
  readonly #handlers = new Map<string, CallbackHandler>();
  readonly #closers = new Set<(reason?: RobotRaconteurError) => void>();
  readonly #releaseListeners = new Set<(path: string) => void>();
  readonly #connected: Promise<string>;
  #settleConnected!: { resolve(type: string): void; reject(reason: unknown): void };
  readonly #closed: Promise<void>;
  #settleClosed!: () => void;

  /** `transport` is open; `timeout`: of requests that bring none, in milliseconds. */
  constructor(
    private readonly core: Core,
    private readonly transport: Transport,
    private readonly timeout: number,
  ) {
    this.#connected = new Promise((resolve, reject) => (this.#settleConnected = { resolve, reject }));
    this.#connected.catch(() => undefined); // whoever waits for it hears of it
    this.#closed = new Promise((resolve) => (this.#settleClosed = resolve));
    this.#timer = lookTimer(
      transport,
      () => core.pollTimeout(),
      () => {
        this.#guarded(() => core.handleTimeout());
        this.#pump();
      },
    );
  }

  /** Begins the handshake. Resolves with the root object's type. */
  start(): Promise<string> {
    this.#pump();
    return this.#connected;
  }

  get isClosed(): boolean {
    return this.#end !== undefined;
  }

  // --- the transport's news ---

  received(bytes: Uint8Array): void {
    if (this.#isClosed) return;
    this.#guarded(() => this.core.handleBytes(bytes));
    this.#pump();
  }

  /** The stream is gone. */
  lost(reason: string): void {
    if (this.#isClosed) return;
    this.#guarded(() => this.core.handleClosed(reason));
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
      checkSignal(signal);
      if (signal?.aborted) return reject(signal.reason);
      if (this.#end) return reject(this.#end.reason);
      const id = this.#told((core) => {
        core.prepareRequest(checkTimeout(options.timeout ?? this.timeout), this.#isUrgent);
        return ask(core);
      });
      const abort = () => {
        this.#pending.delete(id);
        if (!this.#isClosed) this.#guarded(() => this.core.cancel(id));
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

  /** As request(), for what commands the object at `path`: a lease of it says how long that may take. */
  command(path: string, ask: (core: Core) => number, options: CallOptions = {}): Promise<RrValue> {
    return this.request(ask, { ...options, timeout: options.timeout ?? this.timeoutAt?.(path) });
  }

  /** What is asked for meanwhile goes past whatever waits. */
  urgently<T>(what: () => T): T {
    this.#isUrgent = true;
    try {
      return what();
    } finally {
      this.#isUrgent = false;
    }
  }

  /** Something without an answer. @throws RobotRaconteurError */
  tell<T>(what: (core: Core) => T): T {
    if (this.#end) throw this.#end.reason;
    try {
      return this.#told(what);
    } finally {
      this.#pump(); // also where it failed: the service may be told so
    }
  }

  /** Nothing where there is room for more to send; else what resolves when there is. */
  room(): Promise<void> | undefined {
    if (this.#end || this.#hasRoom()) return undefined;
    return new Promise((resolve, reject) => this.#senders.push({ resolve, reject }));
  }

  /** Something that sends nothing; undefined once the session is over. */
  look<T>(at: (core: Core) => T): T | undefined {
    return this.#isClosed ? undefined : at(this.core);
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
  setHandler(path: string, member: string, handler: CallbackHandler | null): void {
    const key = `${path} ${member}`;
    if (handler) this.#handlers.set(key, handler);
    else this.#handlers.delete(key);
  }

  handler(path: string, member: string): CallbackHandler | null {
    return this.#handlers.get(`${path} ${member}`) ?? null;
  }

  onRelease(released: (path: string) => void): () => void {
    this.#releaseListeners.add(released);
    return () => void this.#releaseListeners.delete(released);
  }

  /**
   * Calls once, when the session has ended or the service has replaced the object; soon, if that has happened already.
   * @param isReleased  whether it has replaced it
   */
  onEnd(path: string, isReleased: boolean, ended: (reason?: RobotRaconteurError) => void): () => void {
    const stopClosing = this.onClose((reason) => end(reason));
    const release = (above: string) => void (isWithin(path, above) && end(releasedObject(path)));
    const stopReleasing = this.onRelease(release);
    const stop = () => {
      stopClosing();
      stopReleasing();
    };
    const end = (reason?: RobotRaconteurError) => {
      stop();
      ended(reason);
    };
    if (isReleased) queueMicrotask(() => this.#releaseListeners.has(release) && release(path));
    return stop;
  }

  /** Calls once, when the session has ended; soon, if it has already. */
  onClose(closed: (reason?: RobotRaconteurError) => void): () => void {
    if (this.#isClosed) {
      let isWanted = true;
      queueMicrotask(() => isWanted && this.#tellClosed(closed));
      return () => void (isWanted = false);
    }
    this.#closers.add(closed);
    return () => void this.#closers.delete(closed);
  }

  // --- the end ---

  /** The core has failed in the middle of something: what it would say of itself means nothing any more. */
  get isBroken(): boolean {
    return this.#isBroken;
  }

  /** Takes leave of the service; what waits for an answer rejects at once. */
  close(): Promise<void> {
    if (!this.#end) {
      this.#end = { reason: closedHere(), isLocal: true };
      this.#rejectPending(this.#end.reason);
      this.#guarded(() => this.core.disconnect());
      this.#pump();
    }
    return this.#closed;
  }

  #rejectPending(reason: RobotRaconteurError): void {
    const waiting = [...this.#pending.values()];
    this.#pending.clear();
    this.#settleConnected.reject(reason);
    for (const { reject } of waiting) reject(reason);
    for (const { reject } of this.#senders.splice(0)) reject(reason);
  }

  #finish(reason: RobotRaconteurError): void {
    if (this.#isClosed) return;
    this.#end ??= { reason, isLocal: false };
    this.#isClosed = true;
    this.#timer.stop();
    this.#rejectPending(this.#end.reason);
    this.transport.close();
    const closers = [...this.#closers];
    this.#closers.clear();
    this.#listeners.clear();
    this.#releaseListeners.clear();
    this.#handlers.clear();
    for (const closed of closers) this.#tellClosed(closed);
    this.#settleClosed();
  }

  #tellClosed(closed: (reason?: RobotRaconteurError) => void): void {
    const end = this.#end;
    callSafely(() => (end && !end.isLocal ? closed(end.reason) : closed()));
  }

  // --- the pump: after whatever was told or asked, poll until nothing is left ---

  #pump(): void {
    if (this.#isPumping || this.#isClosed) return; // a listener asked something: the loop below goes on with it
    this.#isPumping = true;
    const poll = () => this.core.pollTransmit();
    const transmitted = (size: number) => this.core.handleTransmitted(size);
    this.#guarded(() => {
      for (;;) {
        transmit(this.transport, poll, transmitted);
        const event = this.core.pollEvent();
        if (!event) break;
        this.#dispatch(event);
        if (this.#isClosed) break;
      }
    });
    this.#isPumping = false;
    if (this.#isClosed) return;
    if (this.#senders.length > 0 && this.#hasRoom()) for (const { resolve } of this.#senders.splice(0)) resolve();
    this.#timer.arm();
  }

  #hasRoom(): boolean {
    return this.transport.buffered + this.core.queuedBytes() < roomMark;
  }

  #dispatch(event: CoreEvent): void {
    switch (event.kind) {
      case "connected":
        this.#wasConnected = true;
        this.#settleConnected.resolve(event.type);
        break;
      case "completed":
        this.#takePending(event.id)?.resolve(event.value);
        break;
      case "failed":
        this.#takePending(event.id)?.reject(this.#error(event.error));
        break;
      case "event":
        this.#tell(event.path, event.member, (listener) => listener.onEvent?.(event.arguments));
        break;
      case "wire":
        this.#tell(event.path, event.member, (listener) =>
          listener.onWireValue?.(event.value, event.seconds, event.nanoseconds),
        );
        break;
      case "wire_closed":
        this.#tell(event.path, event.member, (listener) => listener.onWireClosed?.());
        break;
      case "pipe":
        this.#tell(event.path, event.member, (listener) => listener.onPipePacket?.(event.index, event.value));
        break;
      case "pipe_acks":
        this.#tell(event.path, event.member, (listener) => listener.onPipeAcks?.(event.index, event.numbers));
        break;
      case "pipe_closed":
        this.#tell(event.path, event.member, (listener) =>
          listener.onPipeClosed?.(event.index, event.error && this.#error(event.error)),
        );
        break;
      case "callback":
        void this.#answer(event);
        break;
      case "path_released":
        for (const key of this.#handlers.keys()) {
          const [path] = key.split(" ", 1) as [string];
          if (isWithin(path, event.path)) this.#handlers.delete(key);
        }
        for (const released of [...this.#releaseListeners]) callSafely(() => released(event.path));
        break;
      case "closed":
        this.#finish(this.#error(event.error));
        break;
    }
  }

  /** A connection that was up and is no more has a mark of its own: what was under way may have been carried out. */
  #error(fields: ErrorFields): RobotRaconteurError {
    const isLoss = this.#wasConnected && fields.code === ErrorCode.ConnectionError && this.core.wantsClose();
    return new RobotRaconteurError(isLoss ? { ...fields, subName: fields.subName || connectionLost } : fields);
  }

  /** Asks the handler of a callback, and tells the service what it said. */
  async #answer({ id, path, member, arguments: args }: CoreEvent & { kind: "callback" }): Promise<void> {
    try {
      const handler = this.#handlers.get(`${path} ${member}`);
      if (!handler) throw makeError("InvalidOperation", "Callback function not set");
      const value = await handler(...args);
      if (this.#end) return;
      // A value that does not fit is this side's mistake: whoever wrote the handler should see it, too.
      callSafely(() => this.tell((core) => core.replyCallback(id, path, member, value)));
    } catch (error) {
      if (!this.#end) this.tell((core) => core.failCallback(id, errorFields(error)));
    }
  }

  #takePending(id: number): Pending | undefined {
    const pending = this.#pending.get(id);
    this.#pending.delete(id);
    return pending;
  }

  #tell(path: string, member: string, what: (listener: MemberListener) => void): void {
    const listeners = this.#listeners.get(`${path} ${member}`);
    if (!listeners) return;
    for (const listener of [...listeners]) callSafely(() => what(listener));
  }

  /** As #guarded(), where a value may also not fit. @throws RobotRaconteurError */
  #told<T>(what: (core: Core) => T): T {
    try {
      return what(this.core);
    } catch (error) {
      if (!(error instanceof WebAssembly.RuntimeError || error instanceof RangeError)) throw error;
      throw this.#break(error);
    }
  }

  /** An exception here is a trap in the core (memory at its end) or a broken transport: the session is over. */
  #guarded(what: () => void): void {
    try {
      what();
    } catch (error) {
      this.#break(error);
    }
  }

  #break(error: unknown): RobotRaconteurError {
    const reason = makeError("InternalError", `the session failed: ${textOf(error)}`);
    this.#isBroken = true;
    this.#finish(reason);
    return reason;
  }
}

/** @throws RobotRaconteurError InvalidArgument */
export function checkTimeout(milliseconds: number, name = "timeout"): number {
  if (milliseconds > 0) return milliseconds;
  throw makeError("InvalidArgument", `${name} ${String(milliseconds)}: expected milliseconds above 0`);
}

/** Whether `path` is that of an object or of one below it. */
export function isWithin(path: string, object: string): boolean {
  return path === object || path.startsWith(`${object}.`);
}

export function releasedObject(path: string): RobotRaconteurError {
  return makeError("ObjectNotFound", `the service released object "${path}": look it up again`);
}

export const closedHere = (): RobotRaconteurError =>
  makeError("ConnectionError", "the session was closed by this side");
