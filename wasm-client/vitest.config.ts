// The tests lie in test/wasm-client and look at what is published: dist/, built by `npm run build`.
import { defineConfig } from "vitest/config";

const modules = `${import.meta.dirname}/node_modules`; // the tests lie elsewhere

const alike = [
  "callback",
  "definition",
  "generator",
  "lease",
  "login",
  "members",
  "memory",
  "misuse",
  "monitor",
  "pipe",
  "session",
  "store",
  "subscribe",
  "transcripts",
  "values",
].map((name) => `test/wasm-client/${name}.test.ts`);

export default defineConfig({
  root: "..",
  resolve: {
    alias: [
      { find: /^svelte\/store$/, replacement: `${modules}/svelte/src/store/index-client.js` },
      { find: /^(happy-dom|react|react-dom|vue)(?=$|\/)/, replacement: `${modules}/$1` },
    ],
  },
  test: {
    globals: true,
    expect: { requireAssertions: true },
    testTimeout: 20_000,
    projects: [
      { extends: true, test: { name: "page", include: ["test/wasm-client/**/*.test.ts"] } },
      // What an application sees is the same with rrgate-client/worker: service.ts connects by it.
      { extends: true, test: { name: "worker", include: alike, env: { ["IN_WORKER"]: "1" } } },
    ],
  },
});
