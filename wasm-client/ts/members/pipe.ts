// Pipes: every packet, in order. Layer: wasm-client/ts/members. Source: sessions spec section 2.11.
import { call_safely, make_error } from "../errors.js";
import type { CallOptions, Losses, PipeConnectOptions, PipeEndpoint, PipeMember, PipeSendOptions, RrValue } from "../types.js";
import { check_signal, within } from "../within.js";
import { losses_of } from "./losses.js";
import type { MemberContext } from "./member.js";
import { ValueQueue } from "./queue.js";

const default_limit = 10_000;
const default_max_bytes = 64 * 1024 * 1024;
/** Packets that wait for their acknowledgement; a service that never sends one must not fill the memory. */
const max_acks = 65_536;
const any_index = -1;

export function make_pipe(context: MemberContext): PipeMember<unknown> {
  let ends: PipeEnds | undefined;
  return Object.freeze({
    connect: async (index?: number | PipeConnectOptions, given: PipeConnectOptions = {}) => {
      const [wanted, options] = typeof index === "object" ? [any_index, index] : [index ?? any_index, given];
      if (!Number.isInteger(wanted) || wanted < any_index || wanted >= 2 ** 31) {
        throw make_error("InvalidArgument", `${context.info.name}: index ${String(wanted)} is not an int32 from 0 on`);
      }
      ends ??= new PipeEnds(context, () => (ends = undefined));
      return ends.connect(wanted, options);
    },
  } satisfies PipeMember<unknown>);
}

/** The endpoints of one pipe that this side has, by index. */
class PipeEnds {
  readonly #endpoints = new Map<number, Endpoint>();
  readonly #stop_listening: () => void;
  #connects = 0;

  /** `unused`: the last endpoint is gone. */
  constructor(
    private readonly context: MemberContext,
    private readonly unused: () => void,
  ) {
    const { session, path, info } = context;
    const stop_listening = session.listen(path, info.name, {
      on_pipe_packet: (index, value) => this.#endpoints.get(index)?.receive(value),
      on_pipe_acks: (index, numbers) => this.#endpoints.get(index)?.acknowledge(numbers),
      on_pipe_closed: (index) => this.#endpoints.get(index)?.end(),
    });
    const stop_closing = session.on_close((reason) => {
      for (const endpoint of [...this.#endpoints.values()]) endpoint.end(reason);
    });
    this.#stop_listening = () => (stop_listening(), stop_closing());
  }

  async connect(wanted: number, options: PipeConnectOptions): Promise<PipeEndpoint> {
    const { session, path, info } = this.context;
    let endpoint: Endpoint | undefined;
    ++this.#connects;
    try {
      await session.request((core) => core.connect_pipe(path, info.name, wanted), options, (value) => {
        // At once: packets may follow the reply in the same message.
        const index = Number(value);
        endpoint = new Endpoint(this.context, index, options, () => {
          this.#endpoints.delete(index);
          this.#check_use();
        });
        this.#endpoints.set(index, endpoint);
      });
      return endpoint as PipeEndpoint;
    } finally {
      --this.#connects;
      this.#check_use();
    }
  }

  #check_use(): void {
    if (this.#connects > 0 || this.#endpoints.size > 0) return;
    this.#stop_listening();
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
  #is_over = false;
  #closed: Promise<void> | undefined;

  constructor(
    private readonly context: MemberContext,
    readonly index: number,
    { limit = default_limit, maxBytes = default_max_bytes }: PipeConnectOptions,
    private readonly gone: () => void,
  ) {
    const overflow = () => {
      const what = `more than ${limit} packets or ${maxBytes} bytes of pipe ${context.info.name} wait`;
      const error = make_error("OutOfSystemResource", `${what} and nobody takes them: the endpoint is closed`);
      this.#closed ??= this.#disconnect(error);
      return error;
    };
    this.#queue = new ValueQueue<RrValue>(limit, () => void this.close(), overflow, maxBytes);
  }

  get isClosed(): boolean {
    return this.#is_over;
  }

  [Symbol.asyncIterator](): AsyncIterator<RrValue, undefined> {
    return this.#queue;
  }

  async send(packet: unknown, { ack = false, ...limits }: PipeSendOptions = {}): Promise<void> {
    const { session, path, info } = this.context;
    check_signal(limits.signal);
    limits.signal?.throwIfAborted();
    if (this.#is_over) throw this.#closed_error();
    if (ack && this.#acks.size >= max_acks) {
      throw make_error("OutOfSystemResource", `${max_acks} packets of pipe ${info.name} wait for their acknowledgement`);
    }
    let acknowledged: Promise<void> | undefined;
    const number = session.tell((core) => {
      const sent = core.send_pipe_packet(path, info.name, this.index, packet, ack);
      if (ack) acknowledged = new Promise((resolve) => this.#acks.set(sent, resolve));
      return sent;
    });
    const taken = acknowledged ?? session.room();
    if (!taken) return;
    const unless_over = within(taken, { signal: this.#ending.signal }, "");
    await within(unless_over, limits, `pipe ${info.name}: the packet was not taken`).finally(() => this.#acks.delete(number));
  }

  losses(options?: CallOptions): Promise<Losses | undefined> {
    return losses_of(this.context, options, this.index);
  }

  onClose(closed: (reason?: unknown) => void): () => void {
    if (this.#is_over) queueMicrotask(() => call_safely(() => closed()));
    else this.#closers.add(closed);
    return () => void this.#closers.delete(closed);
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
    if (this.#is_over) return;
    this.#is_over = true;
    if (reason === undefined) this.#queue.end();
    else this.#queue.fail(reason);
    this.#ending.abort(reason ?? this.#closed_error());
    this.gone();
    const closers = [...this.#closers];
    this.#closers.clear();
    for (const closed of closers) call_safely(() => closed(reason));
  }

  async #disconnect(reason?: unknown): Promise<void> {
    if (this.#is_over) return;
    this.end(reason);
    const { session, path, info } = this.context;
    if (session.is_closed) return;
    // Where the session ends meanwhile, the endpoint has ended with it.
    await session.request((core) => core.disconnect_pipe(path, info.name, this.index)).catch(() => undefined);
  }

  #closed_error(): unknown {
    const { name } = this.context.info;
    return make_error("InvalidOperation", `pipe ${name}: endpoint ${this.index} is closed`);
  }
}
