// rrgate-client/worker with its worker in this thread: page and worker speak over channels, as they do otherwise, and what opens
// connections is the test's.
import { openWebsocket, serveThread } from "../../wasm-client/dist/internal.js";
import type * as page from "../../wasm-client/dist/node.js";
import type { ConnectOptions, OpenTransport } from "../../wasm-client/dist/node.js";
import * as client from "../../wasm-client/dist/worker.js";

/** A worker gets no functions: the token says which it is. */
const transports: OpenTransport[] = [];

/** The proof by which the worker finds `transport`. */
export function proofOf(transport: OpenTransport): { token: string } {
  return { token: String(transports.push(transport) - 1) };
}

function named<O extends ConnectOptions>({ transport, ...others }: O): Omit<O, "transport"> {
  return { ...others, ...(transport && proofOf(transport)) };
}

export const connect: typeof page.connect = (url, options = {}) => client.connect(url, named(options));
export const subscribe: typeof page.subscribe = (urls, options = {}) => client.subscribe(urls, named(options));

/** As the page sees it. */
export function startThread(): Worker {
  const { port1, port2 } = new MessageChannel();
  const scope = { addEventListener: (_: string, heard: unknown) => (port2.onmessage = heard as () => void) };
  serveThread(scope, (url, listener, proof) => {
    const open = transports[Number(proof.token)];
    return open ? open(url, listener) : openWebsocket(url, listener, proof);
  });
  // It ends with the process.
  for (const port of [port1, port2]) (port as unknown as { unref(): void }).unref();
  return { addEventListener: () => undefined, postMessage: port1.postMessage.bind(port1) } as unknown as Worker;
}

client.init({ worker: startThread });
