// The picture of the README: the robot of a running `rrgate demo`, after it has driven a little.
//   node docs/scripts/picture.mjs [http://127.0.0.1:8080]
import { createRequire } from "node:module";
import { fileURLToPath } from "node:url";

const packages = process.env.PLAYWRIGHT_PACKAGE ?? new URL("../../test/e2e/package.json", import.meta.url);
const { chromium } = createRequire(packages)("@playwright/test");
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox"],
});
const page = await browser.newPage({ viewport: { width: 1200, height: 760 }, colorScheme: "light" });
await page.goto(`${process.argv[2] ?? "http://127.0.0.1:8080"}/#/devices/create/Create`);
const press = async (name, milliseconds) => {
  await page.getByRole("button", { name }).hover();
  await page.mouse.down();
  await page.waitForTimeout(milliseconds);
  await page.mouse.up();
};
await page.locator('[data-link="online"]').waitFor();
await press("Forward", 1500);
await press("Left", 700);
await press("Forward", 1500);
await page.mouse.move(0, 0);
await page.waitForTimeout(1000);
await page.screenshot({ path: fileURLToPath(new URL("../images/dashboard.png", import.meta.url)) });
await browser.close();
