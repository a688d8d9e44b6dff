// What a module of the client asks of its page: only functions that the client gives ("js"). A part of the C library that
// wants an operating system (printf, strftime, files) shows here as "wasi_snapshot_preview1", and no page has that.
// Usage: check_wasm_imports.mjs MODULE.wasm
import { readFileSync } from "node:fs";

const path = process.argv[2];
const module = new WebAssembly.Module(readFileSync(path));
const foreign = WebAssembly.Module.imports(module).filter((each) => each.module !== "js");
for (const each of foreign)
  console.error(`${path}: imports ${each.module}.${each.name}; expected: functions of "js" only`);
process.exit(foreign.length ? 1 : 0);
