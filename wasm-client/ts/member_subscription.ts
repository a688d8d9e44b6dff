// Wires and pipes that outlive connections. Layer: wasm-client/ts. Source: sessions spec section 2.17.
import type { Clock } from "./clock.js";
import { asyncDispose } from "./dispose.js";
import { callSafely, ErrorCode, makeError } from "./errors.js";
import type { RobotRaconteurError } from "./errors.js";
import { overflowError, queueLimits, ValueQueue } from "./members/queue.js";
import { ValueStore } from "./store.js";
import type { Store } from "./store.js";
import type { Subscription } from "./subscribe.js";
import type { CallOptions, Losses, PipeEndpoint, RemoteObject, RrValue, WireConnection, WireTime } from "./types.js";

export interface MemberSubscriptionOptions {
  /** The object that the member belongs to: "*" is the root, "*.arm" one of its object references; "*". */
  path?: string | undefined;
}

export interface PipeSubscriptionOptions extends MemberSubscriptionOptions {
  /** Packets that a loop may be behind; more end it with an error. 10,000. */
  limit?: number | undefined;
  /** Bytes, about, that it may be behind. 64 MiB. */
  maxBytes?: number | undefined;
}

/** To the next attempt, where a member could not be connected or the service closed it. */
const retryMs = 2_500;

interface Connection {
  close(): Promise<unknown>;
}

/** Of wires and pipes. */
interface Stream extends Connection {
  send(value: unknown): Promise<void>;
  losses(options?: CallOptions): Promise<Losses | undefined>;
}

/** Follows a subscription from one connection to the next, and connects its member there. */
abstract class MemberSubscription<C extends Connection, V> implements AsyncIterable<V> {
  protected connection: C | undefined;
  readonly #loops = new Set<ValueQueue<V>>();
  readonly #connected = new Set<() => void>();
  readonly #failed = new Set<(error: unknown) => void>();
  readonly #stops: (() => void)[];
  #stopWaiting: (() => void) | undefined;
  #closed: Promise<void> | undefined;

  /** Use the methods of Subscription. */
  constructor(
    subscription: Subscription<unknown>,
    private readonly clock: Clock,
    protected readonly member: string,
    protected readonly options: PipeSubscriptionOptions,
  ) {
    const attach = (client: unknown) => void this.#attach(client as RemoteObject);
    this.#stops = [subscription.onConnected(attach), subscription.onClosed(() => void this.close())];
    if (subscription.isClosed) void this.close();
  }

  get isConnected(): boolean {
    return this.connection !== undefined;
  }

  /** Calls `connected` each time the member is connected. */
  onConnected(connected: () => void): () => void {
    this.#connected.add(connected);
    return () => void this.#connected.delete(connected);
  }

  /** Calls `failed` each time the member could not be connected, or its connection ended; it is tried again. */
  onFailed(failed: (error: unknown) => void): () => void {
    this.#failed.add(failed);
    return () => void this.#failed.delete(failed);
  }

  /** Leaving the loop closes this subscription of the member. */
  [Symbol.asyncIterator](): AsyncIterator<V, undefined> {
    const queue = this.makeQueue(() => {
      this.#loops.delete(queue);
      void this.close();
    });
    if (this.#closed) queue.end();
    else this.#loops.add(queue);
    return queue;
  }

  /** Ends all loops; they still give what came before. Repeated calls do nothing. */
  close(): Promise<void> {
    return (this.#closed ??= this.#end());
  }

  [asyncDispose](): Promise<void> {
    return this.close();
  }

  /** Connects the member of `object`. */
  protected abstract connect(object: RemoteObject): Promise<C>;
  /** Takes what comes until the connection ends. */
  protected abstract follow(connection: C): Promise<void>;

  /** For a loop that ends with an error where more waits. */
  protected makeQueue(onReturn: () => void): ValueQueue<V> {
    const { limit = queueLimits.limit, maxBytes = queueLimits.maxBytes } = this.options;
    return new ValueQueue<V>(limit, onReturn, () => overflowError(this.member, limit, maxBytes), maxBytes);
  }

  protected receive(value: V): void {
    for (const loop of [...this.#loops]) loop.push(value);
  }

  async #end(): Promise<void> {
    for (const stop of this.#stops) stop();
    this.#stopWaiting?.();
    for (const loop of this.#loops) loop.end();
    this.#loops.clear();
    await this.connection?.close();
  }

  async #attach(client: RemoteObject): Promise<void> {
    this.#stopWaiting?.();
    let connection: C | undefined;
    try {
      connection = await this.connect(await client.$.find(this.options.path ?? "*"));
      if (this.#closed) return void connection.close();
      this.connection = connection;
      for (const connected of [...this.#connected]) callSafely(connected);
      await this.follow(connection);
      throw makeError("InvalidOperation", `${this.member}: the service closed the connection of this member`);
    } catch (error) {
      if (this.#closed) return;
      // More came at once than this side keeps, and is lost: whoever takes it has to know.
      const isFull = (error as RobotRaconteurError).code === ErrorCode.OutOfSystemResource;
      if (isFull && connection && client.$.state === "connected") {
        for (const loop of this.#loops) loop.fail(error);
        this.#loops.clear();
      }
      for (const failed of [...this.#failed]) callSafely(() => failed(error));
    } finally {
      if (connection && this.connection === connection) this.connection = undefined;
    }
    // Without its client this waits for the next one instead.
    if (client.$.state !== "connected") return;
    this.#stopWaiting = this.clock.after(retryMs, () => void this.#attach(client));
  }
}

abstract class StreamSubscription<C extends Stream, V> extends MemberSubscription<C, V> {
  /**
   * Sends over the connection that is up.
   * @throws RobotRaconteurError InvalidOperation (rejects) while there is none: nothing is kept for later.
   */
  send(value: unknown): Promise<void> {
    if (this.connection) return this.connection.send(value);
    return Promise.reject(makeError("InvalidOperation", `${this.member}: is not connected at the moment`));
  }

  /** Of the connection that is up; undefined while there is none, and where the service keeps no account of it. */
  async losses(options?: CallOptions): Promise<Losses | undefined> {
    return this.connection?.losses(options);
  }
}

/** The newest value of a wire, by arrival. */
export class WireSubscription<T = RrValue> extends StreamSubscription<WireConnection<T, unknown>, T> {
  readonly #value = new ValueStore<T | undefined>(undefined);
  #time: WireTime | undefined;

  /** The newest value; it stays while there is no connection. */
  get value(): T | undefined {
    return this.#value.getSnapshot();
  }

  /** The newest value, to follow and to hand to a page's framework. It stays after close(). */
  get store(): Store<T | undefined> {
    return this.#value;
  }

  get time(): WireTime | undefined {
    return this.#time;
  }

  protected override makeQueue(onReturn: () => void): ValueQueue<T> {
    const queue = new ValueQueue<T>(1, onReturn);
    if (this.value !== undefined) queue.push(this.value);
    return queue;
  }

  protected async connect(object: RemoteObject): Promise<WireConnection<T, unknown>> {
    const connection = object.$.member(this.member).connect() as WireConnection as WireConnection<T, unknown>;
    await connection.ready;
    return connection;
  }

  protected async follow(connection: WireConnection<T, unknown>): Promise<void> {
    for await (const value of connection) {
      this.#time = connection.time;
      this.#value.set(value);
      this.receive(value);
    }
  }
}

/** All packets of a pipe, in order for each connection. */
export class PipeSubscription<T = RrValue> extends StreamSubscription<PipeEndpoint<T, unknown>, T> {
  protected async connect(object: RemoteObject): Promise<PipeEndpoint<T, unknown>> {
    return (await object.$.member(this.member).connect(-1, this.options)) as PipeEndpoint<T, unknown>;
  }

  protected async follow(endpoint: PipeEndpoint<T, unknown>): Promise<void> {
    for await (const packet of endpoint) this.receive(packet);
  }
}

interface Occurrences<A> extends Connection {
  readonly loop: AsyncIterator<A>;
}

/** The occurrences of an event, each as the array of its arguments. */
export class EventSubscription<A extends unknown[] = RrValue[]> extends MemberSubscription<Occurrences<A>, A> {
  protected connect(object: RemoteObject): Promise<Occurrences<A>> {
    const event = object.$.member(this.member) as Partial<AsyncIterable<A>>;
    const loop = event[Symbol.asyncIterator]?.();
    if (!loop) return Promise.reject(makeError("MemberNotFound", `${this.member} of ${object.$.type} is no event`));
    return Promise.resolve({ loop, close: async () => loop.return?.() });
  }

  protected async follow({ loop }: Occurrences<A>): Promise<void> {
    for (let step = await loop.next(); !step.done; step = await loop.next()) this.receive(step.value);
  }
}
