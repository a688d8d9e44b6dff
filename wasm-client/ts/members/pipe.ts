// Pipes: every packet, in order. Layer: wasm-client/ts/members. Source: sessions spec section 2.11.
import { asyncDispose } from "../dispose.js";
import { callSafely, makeError } from "../errors.js";
import type {
  CallOptions,
  Losses,
  PipeConnectOptions,
  PipeEndpoint,
  PipeMember,
  PipeSendOptions,
  RrValue,
} from "../types.js";
import { checkSignal, within } from "../within.js";
import { lossesOf } from "./member.js";
import type { MemberContext } from "./member.js";
import { overflowError, queueLimits, ValueQueue } from "./queue.js";

/** Packets that wait for their acknowledgement; a service that never sends one must not fill the memory. */
const maxAcks = 65_536;
const anyIndex = -1;

export function makePipe(context: MemberContext): PipeMember<unknown> {
  let ends: PipeEnds | undefined;
  return Object.freeze({
    connect: async (index?: number | PipeConnectOptions, given: PipeConnectOptions = {}) => {
      const [wanted, options] = typeof index === "object" ? [anyIndex, index] : [index ?? anyIndex, given];
      if (!Number.isInteger(wanted) || wanted < anyIndex || wanted >= 2 ** 31) {
        throw makeError("InvalidArgument", `${context.info.name}: index ${String(wanted)} is not an int32 from 0 on`);
      }
      ends ??= new PipeEnds(context, () => (ends = undefined));
      return ends.connect(wanted, options);
    },
  } satisfies PipeMember<unknown>);
}

/** The endpoints of one pipe that this side has, by index. */
class PipeEnds {
  readonly #endpoints = new Map<number, Endpoint>();
  readonly #stopListening: () => void;
  #connects = 0;

  /** `unused`: the last endpoint is gone. */
  constructor(
    private readonly context: MemberContext,
    private readonly unused: () => void,
  ) {
    const { session, path, info } = context;
    const stopListening = session.listen(path, info.name, {
      onPipePacket: (index, value) => this.#endpoints.get(index)?.receive(value),
      onPipeAcks: (index, numbers) => this.#endpoints.get(index)?.acknowledge(numbers),
      onPipeClosed: (index, reason) => this.#endpoints.get(index)?.end(reason),
    });
    const stopClosing = session.onClose((reason) => {
      for (const endpoint of [...this.#endpoints.values()]) endpoint.end(reason);
    });
    this.#stopListening = () => (stopListening(), stopClosing());
  }

  async connect(wanted: number, options: PipeConnectOptions): Promise<PipeEndpoint> {
    const { session, path, info } = this.context;
    let endpoint: Endpoint | undefined;
    ++this.#connects;
    try {
      await session.request(
        (core) => core.connectPipe(path, info.name, wanted, options),
        options,
        (value) => {
          // At once: packets may follow the reply in the same message.
          const index = Number(value);
          endpoint = new Endpoint(this.context, index, options, () => {
            this.#endpoints.delete(index);
            this.#checkUse();
          });
          this.#endpoints.set(index, endpoint);
        },
      );
      return endpoint as PipeEndpoint;
    } finally {
      --this.#connects;
      this.#checkUse();
    }
  }

  #checkUse(): void {
    if (this.#connects > 0 || this.#endpoints.size > 0) return;
    this.#stopListening();
    this.unused();
  }
}

class Endpoint implements PipeEndpoint {
  readonly #queue: ValueQueue<RrValue>;
  /** Those who wait for an acknowledgement, by packet number. */
  readonly #acks = new Map<number, () => void>();
  readonly #closers = new Set<(reason?: unknown) => void>();
  /** Rejects what waits in send() when the endpoint ends. */
  readonly #ending = new AbortController();
  #isOver = false;
  #closed: Promise<void> | undefined;

  constructor(
    private readonly context: MemberContext,
    readonly index: number,
    { limit = queueLimits.limit, maxBytes = queueLimits.maxBytes }: PipeConnectOptions,
    private readonly gone: () => void,
  ) {
    const overflow = () => {
      const error = overflowError(context.info.name, limit, maxBytes);
      this.#closed ??= this.#disconnect(error);
      return error;
    };
    this.#queue = new ValueQueue<RrValue>(limit, () => void this.close(), overflow, maxBytes);
  }

  get isClosed(): boolean {
    return this.#isOver;
  }

  [Symbol.asyncIterator](): AsyncIterator<RrValue, undefined> {
    return this.#queue;
  }

  async send(packet: unknown, { ack = false, ...limits }: PipeSendOptions = {}): Promise<void> {
    const { session, path, info } = this.context;
    checkSignal(limits.signal);
    limits.signal?.throwIfAborted();
    if (this.#isOver) throw this.#closedError();
    if (ack && this.#acks.size >= maxAcks) {
      throw makeError("OutOfSystemResource", `${maxAcks} packets of pipe ${info.name} wait for their acknowledgement`);
    }
    let acknowledged: Promise<void> | undefined;
    let number = 0;
    await session.tell((core) =>
      core.sendPipePacket(path, info.name, this.index, packet, ack, (sent) => {
        number = sent;
        if (ack) acknowledged = new Promise((resolve) => this.#acks.set(sent, resolve));
      }),
    );
    const taken = acknowledged ?? session.room();
    if (!taken) return;
    const unlessOver = within(taken, { signal: this.#ending.signal }, "");
    await within(unlessOver, limits, `pipe ${info.name}: the packet was not taken`).finally(() => {
      this.#acks.get(number)?.(); // nobody waits for it any more, nor for the endpoint's end
      this.#acks.delete(number);
    });
  }

  losses(options?: CallOptions): Promise<Losses | undefined> {
    return lossesOf(this.context, options, this.index);
  }

  onClose(closed: (reason?: unknown) => void): () => void {
    if (this.#isOver) queueMicrotask(() => callSafely(() => closed()));
    else this.#closers.add(closed);
    return () => void this.#closers.delete(closed);
  }

  [asyncDispose](): Promise<void> {
    return this.close();
  }

  close(): Promise<void> {
    return (this.#closed ??= this.#disconnect());
  }

  // --- for PipeEnds ---

  receive(value: RrValue): void {
    this.#queue.push(value);
  }

  acknowledge(numbers: number[]): void {
    for (const number of numbers) this.#acks.get(number)?.();
  }

  /** What came before can still be taken. */
  end(reason?: unknown): void {
    if (this.#isOver) return;
    this.#isOver = true;
    if (reason === undefined) this.#queue.end();
    else this.#queue.fail(reason);
    this.#ending.abort(reason ?? this.#closedError());
    this.gone();
    const closers = [...this.#closers];
    this.#closers.clear();
    for (const closed of closers) callSafely(() => closed(reason));
  }

  async #disconnect(reason?: unknown): Promise<void> {
    if (this.#isOver) return;
    this.end(reason);
    const { session, path, info } = this.context;
    if (session.isClosed) return;
    // Where the session ends meanwhile, the endpoint has ended with it.
    await session.request((core) => core.disconnectPipe(path, info.name, this.index)).catch(() => undefined);
  }

  #closedError(): unknown {
    const { name } = this.context.info;
    return makeError("InvalidOperation", `pipe ${name}: endpoint ${this.index} is closed`);
  }
}
