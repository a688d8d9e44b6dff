// The compiled core in browsers and their workers. Layer: wasm-client/ts. In Node load_wasm_node.ts stands in for it.

export async function load_wasm(): Promise<WebAssembly.Module> {
  // Written out so that bundlers see it and ship the file.
  const url = new URL("./rrgate.wasm", import.meta.url);
  const response = await fetch(url);
  if (!response.ok) throw new Error(`rrgate.wasm: ${url.href} answered ${response.status} ${response.statusText}`);
  if (response.headers.get("Content-Type")?.startsWith("application/wasm")) {
    return WebAssembly.compileStreaming(response);
  }
  return WebAssembly.compile(await response.arrayBuffer());
}
