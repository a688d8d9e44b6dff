// What pages take, in three engines: bench/, for test/load/browser.py.
import base from "./playwright.config";

export default { ...base, testDir: "bench", testMatch: "*.bench.ts", timeout: 600_000, projects: [{ name: "bench" }] };
