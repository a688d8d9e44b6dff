// subscribe(): a service for as long as it is wanted, whatever becomes of connections. Layer: wasm-client/ts.
// Source: sessions spec section 2.17.
import { Backoff, systemClock } from "./clock.js";
import type { Clock } from "./clock.js";
import { connectWith } from "./connect.js";
import type { Client, ConnectOptions, Memory, UrlSource } from "./connect.js";
import { asyncDispose } from "./dispose.js";
import { callSafely, makeError } from "./errors.js";
import type { RobotRaconteurError } from "./errors.js";
import { findServices } from "./find_services.js";
import type { ServiceQuery } from "./find_services.js";
import { EventSubscription, PipeSubscription, WireSubscription } from "./member_subscription.js";
import type { MemberSubscriptionOptions, PipeSubscriptionOptions } from "./member_subscription.js";
import { ValueStore } from "./store.js";
import type { Store } from "./store.js";
import type {
  ArgumentsOf,
  CallbackLike,
  CallOptions,
  EventLike,
  MembersLike,
  PacketOf,
  PipeLike,
  RemoteObject,
  WireLike,
} from "./types.js";
import { parseServiceUrl } from "./url.js";
import { checkSignal, within } from "./within.js";

export interface SubscribeOptions extends ConnectOptions {
  /** Ends the subscription. */
  signal?: AbortSignal | undefined;
  /** Milliseconds from the first failure to the next attempt, about: half of it is left to chance. 500. */
  firstRetry?: number | undefined;
  /** Each further wait is twice as long, up to this; 30,000. */
  longestRetry?: number | undefined;
  /** Waits; for tests. */
  clock?: Clock | undefined;
  /** 0 up to 1, as Math.random; for tests. */
  random?: (() => number) | undefined;
}

/** What a subscription is doing. `reason`: why the last attempt failed, or the last connection was lost. */
export type SubscriptionState =
  | { readonly status: "connecting"; readonly reason?: unknown }
  | { readonly status: "connected" }
  /** `nextTry`: as Date.now() has it; retryNow() goes before it. */
  | { readonly status: "waiting"; readonly reason: unknown; readonly nextTry: number }
  | { readonly status: "closed" };

type Way = string | URL | UrlSource;

/**
 * Stays connected to a service: connects, and connects again after each loss, until close().
 * @param urls  one service, or several ways to it; each attempt tries them in order. As for connect(): a function is asked
 *              for its URL at each attempt. Or the services of a type behind a gateway, as its devices come and go: the
 *              first one that can be connected to, and after a loss the first again; each attempt asks the gateway anew.
 * @throws      RobotRaconteurError InvalidArgument (URLs that name different services, no URL, signal). What fails later is told
 *              to onFailed() and tried again.
 */
export function subscribe<T = RemoteObject>(
  urls: Way | readonly Way[] | ServiceQuery,
  options: SubscribeOptions = {},
): Subscription<T> {
  checkSignal(options.signal);
  if (typeof urls === "object" && "gateway" in urls) return new Subscription<T>(urls, options);
  const list: Way[] = [urls].flat();
  // What functions give is known later.
  const fixed = list.filter((way) => typeof way !== "function");
  const services = new Set(fixed.map((url) => parseServiceUrl(url).service));
  if (list.length === 0 || services.size > 1) {
    const found = services.size === 0 ? "no URL" : `the services ${[...services].join(", ")}`;
    throw makeError("InvalidArgument", `subscribe: found ${found}, expected URLs of one service`);
  }
  return new Subscription<T>(list, options);
}

/** One service that is wanted. Calls that are under way when a connection is lost reject: they are not repeated. */
export class Subscription<T = RemoteObject> {
  readonly #urls: readonly Way[] | ServiceQuery;
  readonly #options: SubscribeOptions;
  readonly #clock: Clock;
  readonly #backoff: Backoff;
  readonly #ending = new AbortController();
  /** Of whichever service it was: one with other definitions sends its own. */
  readonly #memory: Memory = { known: [] };
  #client: Client<T> | undefined;
  #stopWaiting: (() => void) | undefined;
  #closed: Promise<void> | undefined;
  #reason: unknown;
  readonly #state = new ValueStore<SubscriptionState>(Object.freeze({ status: "connecting" }));
  readonly #connected = new Set<(client: Client<T>) => void>();
  readonly #lost = new Set<(reason: RobotRaconteurError) => void>();
  readonly #failed = new Set<(error: unknown, url: string) => void>();
  readonly #waiting = new Set<(milliseconds: number) => void>();
  readonly #ended = new Set<() => void>();

  /** Use subscribe(). */
  constructor(urls: readonly Way[] | ServiceQuery, options: SubscribeOptions) {
    this.#urls = urls;
    this.#options = options;
    this.#clock = options.clock ?? systemClock;
    this.#backoff = new Backoff(
      options.firstRetry ?? 500,
      options.longestRetry ?? 30_000,
      options.random ?? Math.random,
    );
    const { signal } = options;
    if (signal?.aborted) void this.close();
    else signal?.addEventListener("abort", () => void this.close(), { once: true, signal: this.#ending.signal });
    void this.#connect();
  }

  /** The root object of the connection that is up; undefined while there is none. Another one after each loss. */
  get defaultClient(): Client<T> | undefined {
    return this.#client;
  }

  get isClosed(): boolean {
    return this.#closed !== undefined;
  }

  /** What it is doing, to look at, to follow and to hand to a page's framework. */
  get state(): Store<SubscriptionState> {
    return this.#state;
  }

  /**
   * The root object, as soon as there is a connection.
   * @throws RobotRaconteurError RequestTimeout, InvalidOperation (closed); the reason of `signal`.
   */
  client({ signal, timeout }: CallOptions = {}): Promise<Client<T>> {
    const stops: (() => void)[] = [];
    const client = new Promise<Client<T>>((resolve, reject) => {
      if (this.isClosed) return reject(closedError());
      if (this.#client) return resolve(this.#client);
      stops.push(
        this.onConnected(resolve),
        this.#on(this.#ended, () => reject(closedError())),
      );
      if (timeout === undefined) return;
      const late = () => reject(makeError("RequestTimeout", `no connection within ${timeout} ms`));
      stops.push(this.#clock.after(timeout, late));
    });
    return within(client, { signal }, "").finally(() => stops.forEach((stop) => stop()));
  }

  /** Calls `connected` with each new root object, also with the one that is there. @returns a function that ends it. */
  onConnected(connected: (client: Client<T>) => void): () => void {
    let isWanted = true;
    const stop = this.#on(this.#connected, connected);
    const client = this.#client;
    if (client) queueMicrotask(() => isWanted && this.#client === client && callSafely(() => connected(client)));
    return () => {
      isWanted = false;
      stop();
    };
  }

  /** Calls `lost` with the reason each time a connection ends that close() did not end. */
  onLost(lost: (reason: RobotRaconteurError) => void): () => void {
    return this.#on(this.#lost, lost);
  }

  /**
   * Calls `failed` for each URL that an attempt could not connect to, or the gateway's where it found no service; "" for
   * one that a function gives: it may hold a ticket.
   */
  onFailed(failed: (error: unknown, url: string) => void): () => void {
    return this.#on(this.#failed, failed);
  }

  /** Calls `waiting` with the milliseconds to the next attempt each time that one is put off. */
  onWaiting(waiting: (milliseconds: number) => void): () => void {
    return this.#on(this.#waiting, waiting);
  }

  /** Attempts now instead of at the end of such a wait; the waits after it are short again. Else nothing happens. */
  retryNow(): void {
    if (!this.#stopWaiting) return;
    this.#stopWaiting();
    this.#backoff.reset();
    void this.#connect();
  }

  /** The newest value of a wire, over all connections. `options.path`: of the object, "*" for the root. */
  wire<K extends MembersLike<T, WireLike>>(
    member: K,
    options?: MemberSubscriptionOptions & { path?: "*" | undefined },
  ): WireSubscription<PacketOf<T, K>>;
  wire(member: string, options: MemberSubscriptionOptions): WireSubscription;
  wire(member: string, options: MemberSubscriptionOptions = {}): unknown {
    return new WireSubscription(this as Subscription<unknown>, this.#clock, member, options);
  }

  /** The packets of a pipe, over all connections; those that the service sends meanwhile are not there. */
  pipe<K extends MembersLike<T, PipeLike>>(
    member: K,
    options?: PipeSubscriptionOptions & { path?: "*" | undefined },
  ): PipeSubscription<PacketOf<T, K>>;
  pipe(member: string, options: PipeSubscriptionOptions): PipeSubscription;
  pipe(member: string, options: PipeSubscriptionOptions = {}): unknown {
    return new PipeSubscription(this as Subscription<unknown>, this.#clock, member, options);
  }

  /** The occurrences of an event, over all connections; those that nobody was connected for are not there. */
  event<K extends MembersLike<T, EventLike>>(
    member: K,
    options?: PipeSubscriptionOptions & { path?: "*" | undefined },
  ): EventSubscription<ArgumentsOf<T, K>>;
  event(member: string, options: PipeSubscriptionOptions): EventSubscription;
  event(member: string, options: PipeSubscriptionOptions = {}): unknown {
    return new EventSubscription(this as Subscription<unknown>, this.#clock, member, options);
  }

  /**
   * Answers a callback of the root object, on each connection.
   * @returns a function that ends it. A member that is missing, or no callback, is told to onFailed().
   */
  callback<K extends MembersLike<T, CallbackLike>>(
    member: K,
    handler: T[K] extends { handler: infer H } ? NonNullable<H> : never,
  ): () => void {
    const setHandler = (client: Client<T> | undefined, to: typeof handler | null) => {
      if (client) (client.$.member(member) as { handler: unknown }).handler = to;
    };
    const stop = this.onConnected((client) => {
      try {
        setHandler(client, handler);
      } catch (error) {
        this.#tellFailed(error, "");
      }
    });
    return () => {
      stop();
      if (this.#client?.$.state === "connected") setHandler(this.#client, null);
    };
  }

  /** Ends the connection and all attempts. Repeated calls do nothing. */
  close(): Promise<void> {
    return (this.#closed ??= this.#end());
  }

  [asyncDispose](): Promise<void> {
    return this.close();
  }

  /** For what belongs to this subscription: calls once when it is closed. */
  onClosed(closed: () => void): () => void {
    return this.#on(this.#ended, closed);
  }

  async #end(): Promise<void> {
    const client = this.#client;
    this.#client = undefined;
    this.#stopWaiting?.();
    this.#ending.abort(closedError());
    this.#become({ status: "closed" });
    this.#state.end();
    await Promise.resolve(); // whoever closes has the promise before anybody hears of it
    for (const ended of [...this.#ended]) callSafely(ended);
    for (const listeners of [this.#connected, this.#lost, this.#failed, this.#waiting, this.#ended]) listeners.clear();
    await client?.$.close();
  }

  /** One attempt: the first URL that works. Without any, the next attempt follows after a while. */
  async #connect(): Promise<void> {
    this.#stopWaiting = undefined;
    if (!this.isClosed && this.#state.getSnapshot().status !== "connecting")
      this.#become({ status: "connecting", reason: this.#reason });
    const { signal: _, ...options } = this.#options;
    const { signal } = this.#ending;
    for (const url of await this.#ways()) {
      if (this.isClosed) return;
      try {
        return this.#take(await connectWith<T>(url, { ...options, signal }, this.#memory));
      } catch (error) {
        this.#tellFailed(error, url);
      }
    }
    this.#retry();
  }

  async #ways(): Promise<readonly Way[]> {
    const query = this.#urls;
    if (!("gateway" in query)) return query;
    try {
      const found = await findServices({ ...this.#options, ...query }, this.#ending.signal);
      if (found.length > 0) return found.map(({ url }) => url);
      throw makeError("ServiceNotFound", `no service of type ${query.type} at the gateway ${query.gateway}`);
    } catch (error) {
      this.#tellFailed(error, query.gateway);
      return [];
    }
  }

  #tellFailed(error: unknown, way: Way): void {
    if (this.isClosed) return;
    this.#reason = error;
    const url = typeof way === "function" ? "" : String(way);
    for (const failed of [...this.#failed]) callSafely(() => failed(error, url));
  }

  #take(client: Client<T>): void {
    if (this.isClosed) return void client.$.close();
    this.#client = client;
    this.#reason = undefined;
    this.#backoff.reset();
    const listeners = [...this.#connected]; // one who comes because of the new state hears of the client by itself
    this.#become({ status: "connected" });
    client.$.onClose((reason) => {
      if (this.#client !== client) return;
      this.#client = undefined;
      const why = reason ?? makeError("ConnectionError", "the client was closed by this side");
      this.#reason = why;
      for (const lost of [...this.#lost]) callSafely(() => lost(why));
      this.#retry();
    });
    for (const connected of listeners) if (this.#connected.has(connected)) callSafely(() => connected(client));
  }

  #retry(): void {
    if (this.isClosed) return;
    const wait = this.#backoff.next();
    this.#stopWaiting = this.#clock.after(wait, () => void this.#connect());
    this.#become({ status: "waiting", reason: this.#reason, nextTry: Date.now() + wait });
    if (this.#state.getSnapshot().status !== "waiting") return; // a listener has ended the wait
    for (const waiting of [...this.#waiting]) callSafely(() => waiting(wait));
  }

  #become(state: SubscriptionState): void {
    this.#state.set(Object.freeze(state));
  }

  #on<F>(listeners: Set<F>, listener: F): () => void {
    if (this.isClosed) return () => undefined;
    listeners.add(listener);
    return () => void listeners.delete(listener);
  }
}

const closedError = () => makeError("InvalidOperation", "the subscription is closed");
