// The tests lie in test/wasm-client and look at what is published: dist/, built by `npm run build`.
import { defineConfig } from "vitest/config";

export default defineConfig({
  root: "..",
  test: {
    include: ["test/wasm-client/**/*.test.ts"],
    globals: true,
    expect: { requireAssertions: true },
    testTimeout: 20_000,
  },
});
