// Puts what CMake's preset "wasm" built beside the compiled TypeScript. Part of `npm run build`.
import { copyFile, mkdir } from "node:fs/promises";

const from = new URL("../../build/wasm/wasm-client/", import.meta.url);
const to = new URL("../dist/", import.meta.url);
await mkdir(to, { recursive: true });
for (const file of ["rrgate.wasm"]) {
  await copyFile(new URL(file, from), new URL(file, to)).catch((error) => {
    throw new Error(`${file} is not built: run "cmake --build --preset wasm --target rrgate_wasm" first (${error.message})`);
  });
}
