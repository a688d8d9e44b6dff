// What pages show of a device, as stores that live while somebody looks: what the hooks of React, Vue and Svelte stand on.
// Layer: wasm-client/ts.
import type { Client } from "../connect.js";
import { callSafely, makeError } from "../errors.js";
import type { MemberSubscriptionOptions } from "../member_subscription.js";
import { ValueStore } from "../store.js";
import type { Store } from "../store.js";
import { subscribe } from "../subscribe.js";
import type { SubscribeOptions, Subscription, SubscriptionState } from "../subscribe.js";
import type {
  ArgumentsOf,
  DynamicMember,
  EventLike,
  MembersLike,
  PacketOf,
  RemoteObject,
  RrValue,
  WireLike,
  WireTime,
} from "../types.js";

/** What React, Svelte and Vue need of a store. */
export type View<T> = Pick<Store<T>, "getSnapshot" | "subscribe">;

/** A device as a page has it. `client` and `subscription` are there while it is wanted and connected, or wanted. */
export interface DeviceState<T = RemoteObject> {
  readonly client: Client<T> | undefined;
  readonly subscription: Subscription<T> | undefined;
  readonly state: SubscriptionState;
  /**
   * Settles with the first `client`; the same promise as long as the device is wanted. Rejects where it is given up before, by `signal`
   * or because it is not wanted any more.
   */
  readonly ready: Promise<Client<T>>;
}

/** What a wire gave last. It stays when the connection is lost: `isConnected` and `receivedAt` tell what it is worth. */
export interface WireState<V> {
  readonly value: V | undefined;
  /** By the sender's clock. */
  readonly time: WireTime | undefined;
  /** By this side's clock, as Date.now() has it. */
  readonly receivedAt: number | undefined;
  /** Whether newer values would come. */
  readonly isConnected: boolean;
}

/** What a member gave last. `error`: why it gave nothing newer. */
export interface MemberState<V> {
  readonly value: V | undefined;
  readonly error: unknown;
  /** Whether a request is under way. */
  readonly isBusy: boolean;
}

export type Urls<T> = Parameters<typeof subscribe<T>>[0];

export interface PropertyLike {
  get(...args: never[]): Promise<unknown>;
}

export interface FunctionLike {
  (...args: never[]): Promise<unknown>;
}

export type ValueOf<T, K> = string extends keyof T
  ? PacketOf<T, K>
  : K extends keyof T
    ? T[K] extends { get(...args: never[]): Promise<infer V> }
      ? V
      : never
    : never;

/** What the property `K` of `T` may be set to. */
export type SettableOf<T, K> = string extends keyof T
  ? unknown
  : K extends keyof T
    ? T[K] extends { set(value: infer S, ...args: never[]): Promise<void> }
      ? S
      : never
    : never;

/** What the function `K` of `T` returns. */
export type ReturnOf<T, K> = string extends keyof T
  ? RrValue
  : K extends keyof T
    ? T[K] extends (...args: never[]) => Promise<infer R>
      ? R
      : never
    : never;

export type ParametersOf<T, K> = string extends keyof T
  ? unknown[]
  : K extends keyof T
    ? T[K] extends { (...args: infer A): Promise<unknown>; (...args: never[]): Promise<unknown> }
      ? A
      : never
    : never;

export interface PropertyOptions {
  /** Milliseconds between two reads, more where an answer takes longer; without it, it is read once for each connection, and after refresh(). */
  every?: number | undefined;
}

/** `S`: what may be written; nothing where the property is readonly. */
export interface PropertyStore<V, S = V> extends View<MemberState<V>> {
  /** Writes, then reads. @throws RobotRaconteurError (rejects) as set() of the property; InvalidOperation: not connected. */
  readonly set: (value: S) => Promise<void>;
  /** Reads now. Never rejects: the store has the error. */
  readonly refresh: () => Promise<void>;
}

export interface CallStore<A extends unknown[], V> extends View<MemberState<V>> {
  /** @throws RobotRaconteurError (rejects) as the function does; also kept in the store. */
  readonly call: (...args: A) => Promise<V>;
}

/** `start` with the first listener, what it returns soon after the last has gone: not where one comes back at once. */
class LiveStore<T> implements View<T> {
  readonly #store: ValueStore<T>;
  #stop: (() => void) | undefined;
  #listeners = 0;

  constructor(
    value: T,
    private readonly start: () => () => void,
  ) {
    this.#store = new ValueStore(value);
  }

  readonly getSnapshot = (): T => this.#store.getSnapshot();

  readonly subscribe = (listener: (value: T) => void): (() => void) => {
    this.#listeners += 1;
    this.#stop ??= this.start();
    const leave = this.#store.subscribe(listener);
    let isOver = false;
    return () => {
      if (isOver) return;
      isOver = true;
      leave();
      this.#listeners -= 1;
      queueMicrotask(() => {
        if (this.#listeners > 0) return;
        this.#stop?.();
        this.#stop = undefined;
      });
    };
  };

  show(value: T): void {
    this.#store.set(value);
  }
}

/** Connected while somebody looks. */
export function deviceStore<T = RemoteObject>(urls: Urls<T>, options?: SubscribeOptions): View<DeviceState<T>> {
  let [none, isReady, isOver] = unconnected<T>();
  const store: LiveStore<DeviceState<T>> = new LiveStore(none, () => {
    const subscription = subscribe<T>(urls, options);
    subscription.client().catch(isOver);
    const stop = subscription.state.subscribe((state) => {
      const client = subscription.defaultClient;
      if (client) isReady(client);
      store.show({ ...none, client, subscription, state });
    });
    return () => {
      stop();
      [none, isReady, isOver] = unconnected();
      store.show(none);
      void subscription.close();
    };
  });
  return store;
}

function unconnected<T>(): [DeviceState<T>, (client: Client<T>) => void, (reason: unknown) => void] {
  let isReady!: (client: Client<T>) => void;
  let isOver!: (reason: unknown) => void;
  const ready = new Promise<Client<T>>((resolve, reject) => ([isReady, isOver] = [resolve, reject]));
  ready.catch(() => undefined); // mostly nobody waits for it
  return [{ client: undefined, subscription: undefined, state: { status: "connecting" }, ready }, isReady, isOver];
}

/** What a wire gave last, and whether that can still be so. */
export function wireStore<T, K extends MembersLike<T, WireLike>>(
  device: Subscription<T> | undefined,
  member: K,
  options: MemberSubscriptionOptions = {},
): View<WireState<PacketOf<T, K>>> {
  type State = WireState<PacketOf<T, K>>;
  const none = { value: undefined, time: undefined, receivedAt: undefined, isConnected: false };
  const store: LiveStore<State> = new LiveStore<State>(none, () => {
    if (!device) return () => undefined;
    const wire = device.wire(member, options);
    const show = (news: Partial<State>) => store.show({ ...store.getSnapshot(), ...news });
    const lost = () => show({ isConnected: false });
    const stops = [
      wire.onConnected(() => show({ isConnected: true })),
      wire.onFailed(lost),
      device.onClosed(lost),
      wire.store.subscribe((value) => {
        if (value !== undefined) show({ value: value as PacketOf<T, K>, time: wire.time, receivedAt: Date.now() });
      }),
    ];
    return () => {
      for (const stop of stops) stop();
      lost();
      void wire.close();
    };
  });
  return store;
}

/** Calls `listener` for each occurrence. @returns a function that ends it. */
export function listen<T, K extends MembersLike<T, EventLike>>(
  device: Subscription<T> | undefined,
  member: K,
  listener: (...args: ArgumentsOf<T, K>) => void,
): () => void {
  if (!device) return () => undefined;
  const event = device.event(member);
  void (async () => {
    for await (const args of event) callSafely(() => listener(...args));
  })().catch(() => undefined);
  return () => void event.close();
}

/** The value of a property, read for each connection. */
export function propertyStore<T = RemoteObject, K extends MembersLike<T, PropertyLike> = MembersLike<T, PropertyLike>>(
  device: Subscription<T> | undefined,
  member: K,
  { every }: PropertyOptions = {},
): PropertyStore<ValueOf<T, K>, SettableOf<T, K>> {
  type V = ValueOf<T, K>;
  const store: LiveStore<MemberState<V>> = new LiveStore<MemberState<V>>(idle, () => {
    // Shown again during an outage, with what it had before.
    if (device && !device.defaultClient && store.getSnapshot().value !== undefined) {
      const state = device.state.getSnapshot();
      const reason = "reason" in state ? state.reason : undefined;
      store.show({ ...store.getSnapshot(), error: reason ?? makeError("ConnectionError", "not connected") });
    }
    const stops = [
      device?.onConnected(() => void refresh()),
      device?.onLost((error) => store.show({ ...store.getSnapshot(), error })),
    ];
    // One read at a time: only the newest tells anything, so that the answer to a slower one would never be heard.
    const tick = () => device?.defaultClient && !store.getSnapshot().isBusy && void refresh();
    const timer = every === undefined ? undefined : setInterval(tick, every);
    return () => {
      for (const stop of stops) stop?.();
      clearInterval(timer);
    };
  });
  const refresh = () => ask<V>(store, async () => (await connected(device, member)).get()).catch(() => undefined);
  const set = async (value: SettableOf<T, K>) => {
    await (await connected(device, member)).set(value);
    await refresh();
  };
  return Object.assign(store, { set, refresh: refresh as () => Promise<void> });
}

/** A function, and what became of its last call. */
export function callStore<T = RemoteObject, K extends MembersLike<T, FunctionLike> = MembersLike<T, FunctionLike>>(
  device: Subscription<T> | undefined,
  member: K,
): CallStore<ParametersOf<T, K>, ReturnOf<T, K>> {
  type V = ReturnOf<T, K>;
  const store: LiveStore<MemberState<V>> = new LiveStore<MemberState<V>>(idle, () => () => undefined);
  const call = (...args: ParametersOf<T, K>) => ask<V>(store, async () => (await connected(device, member))(...args));
  return Object.assign(store, { call });
}

const idle = { value: undefined, error: undefined, isBusy: false };

/** Rejects where there is no connection: nothing is kept for later. */
async function connected<T>(device: Subscription<T> | undefined, member: string): Promise<DynamicMember> {
  const client = device?.defaultClient;
  if (!client) throw new Error(`${member}: is not connected at the moment`);
  return Promise.resolve(client.$.member(member));
}

/** The newest request counts. */
const newest = new WeakMap<object, symbol>();

async function ask<V>(store: LiveStore<MemberState<V>>, request: () => Promise<unknown>): Promise<V> {
  const own = Symbol();
  newest.set(store, own);
  const tell = (state: MemberState<V>) => newest.get(store) === own && store.show(state);
  const { value } = store.getSnapshot();
  tell({ value, error: undefined, isBusy: true });
  try {
    const given = (await request()) as V;
    tell({ value: given, error: undefined, isBusy: false });
    return given;
  } catch (error) {
    tell({ value, error, isBusy: false });
    throw error;
  }
}
