// Somebody who looks at the demo's page and drives its robot.
//
//   node drive_page.mjs URL     prints {"moved": metres, "errors": [text...]}, the latter of the page
import { launchChromium } from "./browser.mjs";

const browser = await launchChromium();
try {
  const page = await browser.newPage();
  const errors = [];
  page.on("pageerror", (error) => errors.push(String(error)));
  await page.goto(`${process.argv[2]}#/devices/create/Create`);
  await page.locator('button:enabled:has-text("Forward")').waitFor();
  const where = async () => Number.parseFloat(await page.locator('[data-pose="x"]').innerText());
  const from = await where();
  await page.keyboard.down("ArrowUp");
  let to = from;
  while (to - from < 0.1) {
    await page.waitForTimeout(50);
    to = await where();
  }
  await page.keyboard.up("ArrowUp");
  console.log(JSON.stringify({ moved: to - from, errors }));
} finally {
  await browser.close();
}
