/**
 * What runs in the worker of rrgate-client/worker: the connections of a page. A script of its own, in one file: bundlers make
 * classic scripts of workers, which can load no parts later.
 * @module
 */
import { makeError } from "./errors.js";
import { openWebsocket } from "./websocket.js";
import { serveThread } from "./worker/serve_thread.js";

serveThread(globalThis, (url, listener, proof) => {
  if (url.protocol !== "rr+usb:") return openWebsocket(url, listener, proof);
  throw makeError("NotImplementedError", "rr+usb: the worker has no USB devices; use connect() of rrgate-client");
});
