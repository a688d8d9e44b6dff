/**
 * Stores for Svelte, which takes them as they are: `$device`, `$speed`.
 * @module
 */
export { callStore, deviceStore, listen, propertyStore, wireStore } from "../stores/stores.js";
export type {
  CallStore,
  DeviceState,
  MemberState,
  PropertyOptions,
  PropertyStore,
  WireState,
} from "../stores/stores.js";
