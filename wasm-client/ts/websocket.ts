// Robot Raconteur over WebSocket. Layer: wasm-client/ts. Source: transports spec section 4.
import { make_error, text_of } from "./errors.js";
import { platform } from "./platform.js";
import type { Transport, TransportListener } from "./transport.js";

export const subprotocol = "robotraconteur.robotraconteur.com";

/** Browsers do not tell a page why it could not connect. */
const page = globalThis.location?.origin;
const in_page = page && `nobody answers there, or does not let pages of ${page} in (a gateway: allowed_origins)`;

/**
 * @throws RobotRaconteurError SystemResourceError: this engine has no WebSocket; ConnectionError: it refuses this URL.
 *         Everything later is told to `listener`.
 */
export async function open_websocket(url: URL, listener: TransportListener): Promise<Transport> {
  const WebSocketClass = await platform.find_websocket();
  const where = `${url.protocol}//${url.host}${url.pathname}`;
  let socket: WebSocket;
  try {
    socket = new WebSocketClass(url.href, [subprotocol]);
  } catch (error) {
    // A page that came encrypted may not open ws:.
    throw make_error("ConnectionError", `could not connect to ${where}: ${text_of(error)}`);
  }
  socket.binaryType = "arraybuffer";
  let is_open = false;
  let is_told = false;
  let failure = "";

  const tell_closed = (reason: string) => {
    if (is_told) return;
    is_told = true;
    listener.closed(reason);
  };
  socket.addEventListener("open", () => {
    if (is_told) return;
    is_open = true;
    listener.opened();
  });
  socket.addEventListener("message", (event: MessageEvent) => {
    if (is_told) return;
    if (event.data instanceof ArrayBuffer) listener.received(new Uint8Array(event.data));
    else socket.close(1003, "text frames are not part of the protocol");
  });
  // Browsers do not say what went wrong; other engines may.
  socket.addEventListener("error", (event: Event) => {
    const { message } = event as { message?: unknown };
    if (typeof message === "string") failure = message;
  });
  socket.addEventListener("close", (event: CloseEvent) => {
    const why = event.reason || failure;
    if (is_open) tell_closed(`the connection to ${where} was closed${why ? `: ${why}` : ` (WebSocket code ${event.code})`}`);
    else tell_closed(`could not connect to ${where}${why || in_page ? `: ${why || in_page}` : ""}`);
  });
  return {
    send: (bytes) => socket.send(bytes as Uint8Array<ArrayBuffer>),
    get buffered() {
      return socket.bufferedAmount;
    },
    close: () => {
      is_told = true;
      socket.close(1000);
    },
  };
}
