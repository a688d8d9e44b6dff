/**
 * Hooks for React 18 and later.
 * @module
 */
import { useEffect, useMemo, useRef, useSyncExternalStore } from "react";
import { callStore, deviceStore, listen, propertyStore, wireStore } from "../stores/stores.js";
import type {
  CallStore,
  DeviceState,
  FunctionLike,
  MemberState,
  ParametersOf,
  PropertyLike,
  PropertyOptions,
  PropertyStore,
  ReturnOf,
  SettableOf,
  Urls,
  ValueOf,
  View,
  WireState,
} from "../stores/stores.js";
import type { MemberSubscriptionOptions } from "../member_subscription.js";
import type { SubscribeOptions } from "../subscribe.js";
import type { ArgumentsOf, EventLike, MembersLike, PacketOf, RemoteObject, WireLike } from "../types.js";

export type { DeviceState, MemberState, PropertyOptions, WireState };

const useStore = <T>(store: View<T>): T => useSyncExternalStore(store.subscribe, store.getSnapshot, store.getSnapshot);

/**
 * A device, connected while the component is there.
 * @param urls     as for subscribe(). Another text means another device; a function or query has to stay the same one.
 * @param options  those of the first time count.
 * @returns  with `ready`, by which a component below, within a Suspense boundary, waits for the first connection: use(device.ready);
 * the client of the moment is device.client.
 */
export function useDevice<T = RemoteObject>(urls: Urls<T>, options?: SubscribeOptions): DeviceState<T> {
  const key = typeof urls === "string" || urls instanceof URL || Array.isArray(urls) ? String(urls) : urls;
  // `key` stands for `urls`.
  return useStore(useMemo(() => deviceStore<T>(urls, options), [key]));
}

/** What a wire gave last: `value`, undefined before the first, and whether newer ones would come. */
export function useWire<T, K extends MembersLike<T, WireLike>>(
  { subscription }: DeviceState<T>,
  member: K,
  { path }: MemberSubscriptionOptions = {},
): WireState<PacketOf<T, K>> {
  return useStore(useMemo(() => wireStore(subscription, member, { path }), [subscription, member, path]));
}

/** A property: what was read last, `set(value)` and `refresh()`. */
export function useProperty<T, K extends MembersLike<T, PropertyLike>>(
  { subscription }: DeviceState<T>,
  member: K,
  { every }: PropertyOptions = {},
): MemberState<ValueOf<T, K>> & Pick<PropertyStore<ValueOf<T, K>, SettableOf<T, K>>, "set" | "refresh"> {
  const store = useMemo(() => propertyStore(subscription, member, { every }), [subscription, member, every]);
  return { ...useStore(store), set: store.set, refresh: store.refresh };
}

/** Calls the newest `listener` for each occurrence of an event. */
export function useEvent<T, K extends MembersLike<T, EventLike>>(
  { subscription }: DeviceState<T>,
  member: K,
  listener: (...args: ArgumentsOf<T, K>) => void,
): void {
  const newest = useRef(listener);
  useEffect(() => void (newest.current = listener));
  useEffect(() => listen(subscription, member, (...args) => newest.current(...args)), [subscription, member]);
}

/** A function to `call`, and what became of the last call. */
export function useCall<T, K extends MembersLike<T, FunctionLike>>(
  { subscription }: DeviceState<T>,
  member: K,
): MemberState<ReturnOf<T, K>> & Pick<CallStore<ParametersOf<T, K>, ReturnOf<T, K>>, "call"> {
  const store = useMemo(() => callStore(subscription, member), [subscription, member]);
  return { ...useStore(store), call: store.call };
}
