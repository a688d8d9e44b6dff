// Browser tests of the dashboard. RRGATE names the gateway's program (default: build/release/server/rrgate), CHROMIUM the
// browser (default: /usr/bin/chromium); the dashboard is taken from web/dist, so build it first.
import { defineConfig, devices } from "@playwright/test";

const chromium = {
  executablePath: process.env["CHROMIUM"] ?? "/usr/bin/chromium",
  args: [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
  ],
};

const { viewport, userAgent, deviceScaleFactor, isMobile, hasTouch } = devices["Pixel 7"] ?? {};
const phone = { viewport, userAgent, deviceScaleFactor, isMobile, hasTouch };

export default defineConfig({
  testDir: "tests",
  timeout: 60_000,
  expect: { timeout: 15_000 },
  workers: 1,
  reporter: [["list"]],
  use: { trace: "retain-on-failure", launchOptions: chromium },
  projects: [
    { name: "desktop", use: { viewport: { width: 1280, height: 800 } }, testIgnore: "phone.spec.ts" },
    { name: "phone", use: phone, testMatch: "phone.spec.ts" },
  ],
});
