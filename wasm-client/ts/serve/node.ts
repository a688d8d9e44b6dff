/**
 * rrgate-client/serve in Node: the same, with Node's ways to a file and to a WebSocket.
 * @module
 */
import "../node.js";

export * from "./serve.js";
