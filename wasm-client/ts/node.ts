/**
 * rrgate-client in Node: the same, with Node's ways to a file and to a WebSocket.
 * @module
 */
import { readFile } from "node:fs/promises";
import { makeError } from "./errors.js";
import { headersOf, platform } from "./platform.js";

export * from "./index.js";

platform.loadWasm = async (url) => WebAssembly.compile(await readFile(url));

/** Node's own since version 22, before that the package "ws". */
platform.findWebsocket = async (_, proof) => {
  const headers = headersOf(proof);
  if (typeof globalThis.WebSocket === "function") {
    const Native = globalThis.WebSocket as unknown as NativeClass;
    return class extends Native {
      constructor(url: string | URL, protocols?: string | string[]) {
        super(url, { protocols, headers });
      }
    } as typeof WebSocket;
  }
  const name = "ws"; // not a literal: the package is optional
  const found = (await import(name).catch(() => null)) as { WebSocket: WsClass } | null;
  if (!found)
    throw makeError("SystemResourceError", 'Node before version 22 has no WebSocket: install the package "ws"');
  const { WebSocket: Base } = found;
  return class extends Base {
    constructor(url: string | URL, protocols?: string | string[]) {
      // Compressing would keep the bytes until later, and they are only borrowed; values rarely shrink either.
      super(url, protocols, { perMessageDeflate: false, maxPayload: 0, headers });
    }
  } as typeof WebSocket;
};

/** As Node, Deno and Bun have it, beyond what the standard says. */
type NativeClass = new (url: string | URL, options: object) => WebSocket;
type WsClass = new (url: string | URL, protocols: string | string[] | undefined, options: object) => WebSocket;
