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
export { openWebsocket } from "./websocket.js";
