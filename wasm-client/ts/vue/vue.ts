/**
 * Composables for Vue 3: what they give ends with the component, or the effect scope, that they are called in.
 * @module
 */
import { computed, onScopeDispose, shallowRef, toValue, watch } from "vue";
import type { ComputedRef, MaybeRefOrGetter, ShallowRef } from "vue";
import { callStore, deviceStore, listen, propertyStore, wireStore } from "../stores/stores.js";
import type {
  DeviceState,
  FunctionLike,
  MemberState,
  ParametersOf,
  PropertyLike,
  PropertyOptions,
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
type Device<T> = Readonly<ShallowRef<DeviceState<T>>>;

/** Follows the store of each subscription of the device in turn. */
function useStores<T, S extends View<unknown>>(
  device: Device<T>,
  make: (subscription: DeviceState<T>["subscription"]) => S,
): { store: ComputedRef<S>; value: ShallowRef<ReturnType<S["getSnapshot"]>> } {
  const store = computed(() => make(subscription.value));
  const subscription = computed(() => device.value.subscription);
  const value = shallowRef(store.value.getSnapshot()) as ShallowRef<ReturnType<S["getSnapshot"]>>;
  watch(
    store,
    (now, _, onCleanup) => onCleanup(now.subscribe((next) => (value.value = next as ReturnType<S["getSnapshot"]>))),
    { immediate: true, flush: "sync" },
  );
  return { store, value };
}

/** A device, connected until the scope ends. `urls` as for subscribe(). */
export function useDevice<T = RemoteObject>(urls: Urls<T>, options?: SubscribeOptions): Device<T> {
  const store = deviceStore<T>(urls, options);
  const device = shallowRef(store.getSnapshot());
  onScopeDispose(store.subscribe((now) => (device.value = now)));
  return device;
}

/** What a wire gave last: `value`, undefined before the first, and whether newer ones would come. */
export function useWire<T, K extends MembersLike<T, WireLike>>(
  device: Device<T>,
  member: K,
  options: MemberSubscriptionOptions = {},
): Readonly<ShallowRef<WireState<PacketOf<T, K>>>> {
  return useStores(device, (subscription) => wireStore(subscription, member, options)).value;
}

/** A property: `state` with what was read last, `set(value)` and `refresh()`. */
export function useProperty<T, K extends MembersLike<T, PropertyLike>>(
  device: Device<T>,
  member: K,
  options: MaybeRefOrGetter<PropertyOptions> = {},
): {
  readonly state: Readonly<ShallowRef<MemberState<ValueOf<T, K>>>>;
  set: (value: SettableOf<T, K>) => Promise<void>;
  refresh: () => Promise<void>;
} {
  const { store, value } = useStores(device, (subscription) => propertyStore(subscription, member, toValue(options)));
  return { state: value, set: (to) => store.value.set(to), refresh: () => store.value.refresh() };
}

/** Calls `listener` for each occurrence of an event. */
export function useEvent<T, K extends MembersLike<T, EventLike>>(
  device: Device<T>,
  member: K,
  listener: (...args: ArgumentsOf<T, K>) => void,
): void {
  watch(
    () => device.value.subscription,
    (subscription, _, onCleanup) => onCleanup(listen(subscription, member, listener)),
    { immediate: true, flush: "sync" },
  );
}

/** A function to `call`, and `state` with what became of the last call. */
export function useCall<T, K extends MembersLike<T, FunctionLike>>(
  device: Device<T>,
  member: K,
): {
  readonly state: Readonly<ShallowRef<MemberState<ReturnOf<T, K>>>>;
  call: (...args: ParametersOf<T, K>) => Promise<ReturnOf<T, K>>;
} {
  const { store, value } = useStores(device, (subscription) => callStore(subscription, member));
  return { state: value, call: (...args) => store.value.call(...args) };
}
