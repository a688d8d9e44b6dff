// Puts what CMake's preset "wasm" built beside the compiled TypeScript. Part of `npm run build`.
import { copyFile, mkdir, readFile, writeFile } from "node:fs/promises";

const from = new URL("../../build/wasm/wasm-client/", import.meta.url);
const to = new URL("../dist/", import.meta.url);
for (const folder of ["serve/", "usb/"]) await mkdir(new URL(folder, to), { recursive: true });
for (const [file, place] of [
  ["rrgate.wasm", "rrgate.wasm"],
  ["rrgate-serve.wasm", "serve/rrgate-serve.wasm"],
  ["rrgate-usb.wasm", "usb/rrgate-usb.wasm"],
]) {
  await copyFile(new URL(file, from), new URL(place, to)).catch((error) => {
    throw new Error(
      `${file} is not built: run "cmake --build --preset wasm --target wasm-client/all" first (${error.message})`,
    );
  });
}

// The same with the core in the script, for where no second file can be served.
const core = await readFile(new URL("rrgate.wasm", to), "base64");
await writeFile(
  new URL("inline.js", to),
  `import { init } from "./index.js";
export * from "./index.js";
init({ wasm: () => Uint8Array.from(atob("${core}"), (c) => c.charCodeAt(0)) });
`,
);
await writeFile(new URL("inline.d.ts", to), `export * from "./index.js";\n`);
