/**
 * rrgate-client: Robot Raconteur services in browsers, workers and Node, over WebSocket; in browsers over USB, too.
 * @module
 */
export type { Clock } from "./clock.js";
export { connect } from "./connect.js";
export type { Client, ConnectOptions, UrlSource } from "./connect.js";
export { ErrorCode, RobotRaconteurError } from "./errors.js";
export type { ErrorFields } from "./errors.js";
export type {
  EventSubscription,
  MemberSubscriptionOptions,
  PipeSubscription,
  PipeSubscriptionOptions,
  WireSubscription,
} from "./member_subscription.js";
export { lease } from "./object.js";
export { findServices } from "./find_services.js";
export type { FoundService, ServiceQuery } from "./find_services.js";
export { subscribe } from "./subscribe.js";
export type { SubscribeOptions, Subscription, SubscriptionState } from "./subscribe.js";
export type { Store } from "./store.js";
export type { OpenTransport, Transport, TransportListener } from "./transport.js";
export type * from "./types.js";
export { listUsbDevices, requestUsbDevice } from "./usb_devices.js";
export type { UsbFilter, UsbNode } from "./usb_devices.js";
export { rrValue, typeOf } from "./values.js";
export type { ExactValue } from "./values.js";
export { version } from "./version.js";
export { init, preload } from "./wasm_module.js";
export type { InitOptions, WasmSource } from "./wasm_module.js";
