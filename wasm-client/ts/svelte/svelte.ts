/**
 * Stores for Svelte, which takes them as they are: `$device`, `$speed`. A subscription has one for the same member and
 * options: `$: speed = wireStore($device.subscription, "speed")` asks again with each change of the device.
 * @module
 */
import * as stores from "../stores/stores.js";

export { deviceStore, listen } from "../stores/stores.js";
export type {
  CallStore,
  DeviceState,
  MemberState,
  PropertyOptions,
  PropertyStore,
  WireState,
} from "../stores/stores.js";

/** A function, and what became of its last call. */
export const callStore = keep(stores.callStore);
/** The value of a property, read for each connection. */
export const propertyStore = keep(stores.propertyStore);
/** What a wire gave last, and whether that can still be so. */
export const wireStore = keep(stores.wireStore);

function keep<F extends (device: never, member: never, options: never) => object>(make: F): F {
  const ofDevices = new WeakMap<object, Map<string, object>>();
  const find = (device: object | undefined, member: string, options?: object): object => {
    const makeNew = () => make(device as never, member as never, options as never);
    if (!device) return makeNew();
    const known = ofDevices.get(device) ?? new Map<string, object>();
    ofDevices.set(device, known);
    const key = JSON.stringify([member, { ...options }]);
    const store = known.get(key) ?? makeNew();
    known.set(key, store);
    return store;
  };
  return find as unknown as F;
}
