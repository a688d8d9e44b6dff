// The tests lie in test/wasm-client and look at what is published: dist/, built by `npm run build`.
import { defineConfig } from "vitest/config";

const modules = `${import.meta.dirname}/node_modules`; // the tests lie elsewhere

export default defineConfig({
  root: "..",
  resolve: {
    alias: [
      { find: /^svelte\/store$/, replacement: `${modules}/svelte/src/store/index-client.js` },
      { find: /^(happy-dom|react|react-dom|vue)(?=$|\/)/, replacement: `${modules}/$1` },
    ],
  },
  test: {
    include: ["test/wasm-client/**/*.test.ts"],
    globals: true,
    expect: { requireAssertions: true },
    testTimeout: 20_000,
  },
});
