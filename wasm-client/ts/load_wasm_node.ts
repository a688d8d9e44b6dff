// The compiled core in Node. Layer: wasm-client/ts.
import { readFile } from "node:fs/promises";

export async function load_wasm(): Promise<WebAssembly.Module> {
  return WebAssembly.compile(await readFile(new URL("./rrgate.wasm", import.meta.url)));
}
