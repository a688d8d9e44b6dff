// Puts what CMake's preset "wasm" built beside the compiled TypeScript. Part of `npm run build`.
import { copyFile, mkdir } from "node:fs/promises";

const from = new URL("../../build/wasm/wasm-client/", import.meta.url);
const to = new URL("../dist/", import.meta.url);
await mkdir(new URL("usb/", to), { recursive: true });
for (const [file, place] of [
  ["rrgate.wasm", "rrgate.wasm"],
  ["rrgate-usb.wasm", "usb/rrgate-usb.wasm"],
]) {
  await copyFile(new URL(file, from), new URL(place, to)).catch((error) => {
    throw new Error(
      `${file} is not built: run "cmake --build --preset wasm --target wasm-client/all" first (${error.message})`,
    );
  });
}
