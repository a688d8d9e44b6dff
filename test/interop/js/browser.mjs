// Chromium without a window, as the browser tests start it.
import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";

const e2e = new URL("../../e2e/", import.meta.url);
const { chromium } = createRequire(new URL("package.json", e2e))("@playwright/test");

export async function launchChromium() {
  const launch = JSON.parse(await readFile(new URL("chromium.json", e2e), "utf8"));
  return chromium.launch({ ...launch, executablePath: process.env["CHROMIUM"] ?? launch.executablePath });
}
