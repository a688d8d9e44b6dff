// The WebSocket of Node: its own since version 22, before that the package "ws". Layer: wasm-client/ts.

export async function find_websocket(): Promise<typeof WebSocket> {
  if (typeof globalThis.WebSocket === "function") return globalThis.WebSocket;
  const name = "ws"; // not a literal: the package is optional
  const found = (await import(name).catch(() => null)) as { WebSocket: WsClass } | null;
  if (!found) throw new Error('Node before version 22 has no WebSocket: install the package "ws"');
  const { WebSocket: Base } = found;
  return class extends Base {
    constructor(url: string | URL, protocols?: string | string[]) {
      // Compressing would keep the bytes until later, and they are only borrowed; values rarely shrink either.
      super(url, protocols, { perMessageDeflate: false, maxPayload: 0 });
    }
  } as typeof WebSocket;
}

type WsClass = new (url: string | URL, protocols: string | string[] | undefined, options: object) => WebSocket;
