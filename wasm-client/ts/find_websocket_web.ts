// The WebSocket of browsers and their workers. Layer: wasm-client/ts. In Node find_websocket_node.ts stands in for it.

export function find_websocket(): Promise<typeof WebSocket> {
  return Promise.resolve(WebSocket);
}
