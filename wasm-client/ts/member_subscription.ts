// Wires and pipes that outlive connections. Layer: wasm-client/ts. Source: sessions spec section 2.17.
import type { Clock } from "./clock.js";
import { callSafely, makeError } from "./errors.js";
import { ValueQueue } from "./members/queue.js";
import type { Subscription } from "./subscribe.js";
import type { CallOptions, Losses, PipeEndpoint, RemoteObject, RrValue, WireConnection, WireTime } from "./types.js";

export interface MemberSubscriptionOptions {
  /** The object that the member belongs to: "*" is the root, "*.arm" one of its object references; "*". */
  path?: string | undefined;
}

export interface PipeSubscriptionOptions extends MemberSubscriptionOptions {
  /** Packets that a loop may be behind; more end it with an error. 10,000. */
  limit?: number | undefined;
}

/** To the next attempt, where a member could not be connected or the service closed it. */
const retryMs = 2_500;

interface Connection {
  send(value: unknown): Promise<void>;
  losses(options?: CallOptions): Promise<Losses | undefined>;
  close(): Promise<void>;
}

/** Follows a subscription from one connection to the next, and connects its member there. */
abstract class MemberSubscription<C extends Connection> implements AsyncIterable<RrValue> {
  protected connection: C | undefined;
  readonly #loops = new Set<ValueQueue<RrValue>>();
  readonly #failed = new Set<(error: unknown) => void>();
  readonly #stops: (() => void)[];
  #stopWaiting: (() => void) | undefined;
  #closed: Promise<void> | undefined;

  constructor(
    subscription: Subscription<unknown>,
    private readonly clock: Clock,
    protected readonly member: string,
    private readonly path: string,
  ) {
    const attach = (client: unknown) => void this.#attach(client as RemoteObject);
    this.#stops = [subscription.onConnected(attach), subscription.onClosed(() => void this.close())];
    if (subscription.isClosed) void this.close();
  }

  get isConnected(): boolean {
    return this.connection !== undefined;
  }

  /** Calls `failed` each time the member could not be connected, or its connection ended; it is tried again. */
  onFailed(failed: (error: unknown) => void): () => void {
    this.#failed.add(failed);
    return () => void this.#failed.delete(failed);
  }

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

  /** Leaving the loop closes this subscription of the member. */
  [Symbol.asyncIterator](): AsyncIterator<RrValue, undefined> {
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

  protected abstract makeQueue(onReturn: () => void): ValueQueue<RrValue>;
  /** Connects the member of `object`. */
  protected abstract connect(object: RemoteObject): Promise<C>;
  /** Takes what comes until the connection ends. */
  protected abstract follow(connection: C): Promise<void>;

  protected receive(value: RrValue): void {
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
      const object = this.path === "*" ? client : await client.$.find(this.path);
      connection = await this.connect(object);
      if (this.#closed) return void connection.close();
      this.connection = connection;
      await this.follow(connection);
      throw makeError("InvalidOperation", `${this.member}: the service closed the connection of this member`);
    } catch (error) {
      if (this.#closed) return;
      for (const failed of [...this.#failed]) callSafely(() => failed(error));
    } finally {
      if (connection && this.connection === connection) this.connection = undefined;
    }
    // Without its client this waits for the next one instead.
    if (client.$.state !== "connected") return;
    this.#stopWaiting = this.clock.after(retryMs, () => void this.#attach(client));
  }
}

/** The newest value of a wire, by arrival. */
export class WireSubscription extends MemberSubscription<WireConnection> {
  #value: RrValue | undefined;
  #time: WireTime | undefined;

  /** Use Subscription.wire(). */
  constructor(subscription: Subscription<unknown>, clock: Clock, member: string, options: MemberSubscriptionOptions) {
    super(subscription, clock, member, options.path ?? "*");
  }

  /** The newest value; it stays while there is no connection. */
  get value(): RrValue | undefined {
    return this.#value;
  }

  get time(): WireTime | undefined {
    return this.#time;
  }

  protected makeQueue(onReturn: () => void): ValueQueue<RrValue> {
    const queue = new ValueQueue<RrValue>(1, onReturn);
    if (this.#value !== undefined) queue.push(this.#value);
    return queue;
  }

  protected async connect(object: RemoteObject): Promise<WireConnection> {
    const connection = object.$.member(this.member).connect() as WireConnection;
    await connection.ready;
    return connection;
  }

  protected async follow(connection: WireConnection): Promise<void> {
    for await (const value of connection) {
      this.#value = value;
      this.#time = connection.time;
      this.receive(value);
    }
  }
}

/** All packets of a pipe, in order for each connection. */
export class PipeSubscription extends MemberSubscription<PipeEndpoint> {
  readonly #limit: number;

  /** Use Subscription.pipe(). */
  constructor(subscription: Subscription<unknown>, clock: Clock, member: string, options: PipeSubscriptionOptions) {
    super(subscription, clock, member, options.path ?? "*");
    this.#limit = options.limit ?? 10_000;
  }

  protected makeQueue(onReturn: () => void): ValueQueue<RrValue> {
    return new ValueQueue<RrValue>(this.#limit, onReturn, () =>
      makeError("OutOfSystemResource", `${this.#limit} packets of pipe ${this.member} wait and nobody takes them`),
    );
  }

  protected async connect(object: RemoteObject): Promise<PipeEndpoint> {
    return object.$.member(this.member).connect(-1);
  }

  protected async follow(endpoint: PipeEndpoint): Promise<void> {
    for await (const packet of endpoint) this.receive(packet);
  }
}
