// Browser tests of the dashboard. RRGATE names the gateway's program (default: build/release/server/rrgate), CHROMIUM the
// browser (default: /usr/bin/chromium); the dashboard is taken from web/dist, so build it first.
import launch from "./chromium.json" with { type: "json" };
import { defineConfig, devices } from "@playwright/test";

const chromium = {
  ...launch,
  executablePath: process.env["CHROMIUM"] ?? launch.executablePath,
};

const { viewport, userAgent, deviceScaleFactor, isMobile, hasTouch } = devices["Pixel 7"] ?? {};
const phone = { viewport, userAgent, deviceScaleFactor, isMobile, hasTouch };

export default defineConfig({
  testDir: "tests",
  timeout: 60_000,
  expect: { timeout: 15_000 },
  workers: 1, // what one test measures is not disturbed by another
  forbidOnly: !!process.env["CI"],
  snapshotPathTemplate: "../../docs/images/page/{arg}{ext}",
  reporter: [
    ["list"],
    ["./assertions_reporter.ts"],
    ...(process.env["PLAYWRIGHT_JUNIT_OUTPUT_FILE"] ? [["junit"] as const] : []),
  ],
  // A page that its service worker takes over makes requests past page.route(), from some moment on.
  use: { trace: "retain-on-failure", launchOptions: chromium, serviceWorkers: "block" },
  projects: [
    { name: "desktop", use: { viewport: { width: 1280, height: 800 } }, testIgnore: "phone.spec.ts" },
    { name: "phone", use: phone, testMatch: "phone.spec.ts" },
  ],
});
