/**
 * What the tests look at below the public API; not published.
 * @module
 */
export { JsValues } from "./js_values.js";
export type { CoreExports, Handle } from "./js_values.js";
export { Info } from "./object.js";
export { platform } from "./platform.js";
export { parseServiceUrl } from "./url.js";
export { openUsb } from "./usb_devices.js";
export { Core } from "./wasm_module.js";
export { openWebsocket } from "./websocket.js";
export type { FromHost, ToHost, ToThread } from "./worker/messages.js";
export { RemoteCore } from "./worker/remote_core.js";
export { serveThread } from "./worker/serve_thread.js";
