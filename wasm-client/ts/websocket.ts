// Robot Raconteur over WebSocket. Layer: wasm-client/ts. Source: transports spec section 4.
import { makeError, textOf } from "./errors.js";
import { platform } from "./platform.js";
import type { Proof } from "./platform.js";
import type { Transport, TransportListener } from "./transport.js";

export const subprotocol = "robotraconteur.robotraconteur.com";

/** Browsers do not tell a page why it could not connect. */
const page = globalThis.location?.origin;
const inPage = page && `nobody answers there, or does not let pages of ${page} in (a gateway: allowed_origins)`;

/**
 * @throws RobotRaconteurError SystemResourceError: this engine has no WebSocket; ConnectionError: it refuses this URL;
 *         what platform.findWebsocket() says of `proof`.
 *         Everything later is told to `listener`.
 */
export async function openWebsocket(url: URL, listener: TransportListener, proof: Proof = {}): Promise<Transport> {
  const WebSocketClass = await platform.findWebsocket(url, proof);
  const where = `${url.protocol}//${url.host}${url.pathname}`;
  const closed = `the connection to ${where} was closed`;
  const refused = `could not connect to ${where}`;
  let socket: WebSocket;
  try {
    socket = new WebSocketClass(url.href, [subprotocol]);
  } catch (error) {
    // A page that came encrypted may not open ws:.
    throw makeError("ConnectionError", `${refused}: ${textOf(error)}`);
  }
  socket.binaryType = "arraybuffer";
  let isOpen = false;
  let isTold = false;
  let failure = "";

  const tellClosed = (reason: string) => {
    if (isTold) return;
    isTold = true;
    listener.closed(reason);
  };
  socket.addEventListener("open", () => {
    if (isTold) return;
    isOpen = true;
    listener.opened();
  });
  socket.addEventListener("message", (event: MessageEvent) => {
    if (isTold) return;
    if (event.data instanceof ArrayBuffer) listener.received(new Uint8Array(event.data));
    else tellClosed(`${closed}: found text, expected binary frames`); // whose listener closes
  });
  // Browsers do not say what went wrong; other engines may.
  socket.addEventListener("error", (event: Event) => {
    failure = (event as { message?: string }).message ?? failure;
  });
  socket.addEventListener("close", (event: CloseEvent) => {
    const why = event.reason || failure || (isOpen ? `WebSocket code ${event.code}` : inPage);
    const what = isOpen ? closed : refused;
    tellClosed(why ? `${what}: ${why}` : what);
  });
  return {
    send: (bytes) => socket.send(bytes as Uint8Array<ArrayBuffer>),
    get buffered() {
      return (socket as { bufferedAmount?: number }).bufferedAmount ?? 0; // Cloudflare's has none
    },
    close: () => {
      isTold = true;
      socket.close(1000);
    },
  };
}
