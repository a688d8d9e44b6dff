// Build of the dashboard: static files with hashed names, no inline script or style, so that the gateway can send
// `script-src 'self' 'wasm-unsafe-eval'`. `npm run dev` talks to a gateway on RRGATE_URL (default 127.0.0.1:8080).
//
// The icons in public/*.png are pictures of icon.svg, for systems that take no SVG: 192 and 512 pixels wide and, on its own
// background instead of none (d8eaf1ff for 00000000), 180 as apple-touch-icon.png. One is made so, then put into 12 colours:
//   chromium --headless --hide-scrollbars --default-background-color=00000000 --window-size=192,192 \
//     --screenshot=public/icon-192.png public/icon.svg
//   python3 -c 'import sys; from PIL import Image; f = sys.argv[1]; Image.open(f).convert("RGBA").quantize(12).save(f, optimize=True)' \
//     public/icon-192.png
import { loadEnv } from "vite";
import { defineConfig } from "vitest/config";
import { licences, wasmNotices } from "../cmake/notices.mjs";

const gateway = loadEnv("", ".", "RRGATE_")["RRGATE_URL"] ?? "http://127.0.0.1:8080";

// What several pages load anyhow comes in one file: many small ones are 4 kB more after compression, and as many requests.
const together = [
  { name: "shared", test: /preact|src.(app|live)\/|members.(row|log|refusal)|ui.control_line|values.(format|parse)/ },
  { name: "panels", test: /src.(values.(draft|rows|units|paths|times)|panels.(panel|parts|draft_input))\./ },
];

export default defineConfig({
  base: "./",
  cacheDir: "node_modules/.vite",
  plugins: [licences(wasmNotices)],
  oxc: { jsx: { runtime: "automatic", importSource: "preact" } },
  build: {
    outDir: "dist",
    assetsDir: "assets",
    assetsInlineLimit: 0, // the wasm file stays a file of its own; data: URLs would need a wider policy
    modulePreload: { polyfill: false }, // every browser that runs the target below knows it
    target: "es2022",
    chunkSizeWarningLimit: 600, // three.js, which is loaded with the first 3-D panel
    rolldownOptions: { output: { codeSplitting: { groups: together } } },
  },
  // Pre-bundling would move the module away from the `rrgate.wasm` that it finds by import.meta.url.
  optimizeDeps: { exclude: ["rrgate-client"] },
  server: {
    proxy: {
      "/api": gateway,
      "/devices": { target: gateway, ws: true },
    },
  },
  test: {
    dir: "../test/web",
    // For tests of what is shown: they lie elsewhere, and the client brings a page without a browser.
    alias: [
      { find: /^happy-dom$/, replacement: `${import.meta.dirname}/../wasm-client/node_modules/happy-dom` },
      { find: /^preact$/, replacement: `${import.meta.dirname}/node_modules/preact/dist/preact.mjs` },
    ],
    include: ["**/*.test.ts"],
    globals: true,
    expect: { requireAssertions: true },
  },
});
