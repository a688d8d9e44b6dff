// What engines differ in, as pages and workers have it; node.ts puts Node's ways in its place. Layer: wasm-client/ts.
// Relative imports only: a page loads dist/ as it is, without a bundler.

export interface Platform {
  /** Compiles a file of this package. */
  loadWasm(url: URL): Promise<WebAssembly.Module>;
  /** @throws RobotRaconteurError SystemResourceError: there is none. */
  findWebsocket(): Promise<typeof WebSocket>;
}

export const platform: Platform = {
  async loadWasm(url) {
    const response = await fetch(url);
    if (!response.ok) throw new Error(`${url.href} answered ${response.status} ${response.statusText}`);
    if (response.headers.get("Content-Type")?.startsWith("application/wasm")) {
      return WebAssembly.compileStreaming(response);
    }
    return WebAssembly.compile(await response.arrayBuffer());
  },

  findWebsocket: () => Promise.resolve(WebSocket),
};
