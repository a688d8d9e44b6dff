// What engines differ in, as pages and workers have it; node.ts puts Node's ways in its place. Layer: wasm-client/ts.
// Relative imports only: a page loads dist/ as it is, without a bundler.

export interface Platform {
  /** The compiled core. */
  load_wasm(): Promise<WebAssembly.Module>;
  /** @throws RobotRaconteurError SystemResourceError: there is none. */
  find_websocket(): Promise<typeof WebSocket>;
}

export const platform: Platform = {
  async load_wasm() {
    // Written out so that bundlers see it and ship the file.
    const url = new URL("./rrgate.wasm", import.meta.url);
    const response = await fetch(url);
    if (!response.ok) throw new Error(`rrgate.wasm: ${url.href} answered ${response.status} ${response.statusText}`);
    if (response.headers.get("Content-Type")?.startsWith("application/wasm")) {
      return WebAssembly.compileStreaming(response);
    }
    return WebAssembly.compile(await response.arrayBuffer());
  },

  find_websocket: () => Promise.resolve(WebSocket),
};
