// A shared device on the first page: its mode, its clients, and what each of them listens to and has lost.
import type { Browser, Page } from "@playwright/test";
import { expect, test } from "../lab_test";
import { startGateway, webRoot } from "../processes";
import type { Lab } from "../processes";

const rowOf = (page: Page, device: string) => page.locator(`[data-device="${device}"]`);

/** Somebody who looks at the left camera. */
async function watchCamera(browser: Browser, lab: Lab): Promise<Page> {
  const page = await browser.newPage();
  await page.goto(`${lab.url}#/devices/webcams/Webcam/Webcams%5B0%5D`);
  await page.getByRole("button", { name: "Call StartStreaming" }).click();
  await page.getByRole("button", { name: "Follow FrameStream" }).click();
  await expect(page.locator('[data-member="FrameStream"] li').first()).toContainText("width: 320");
  return page;
}

test("says which device is relayed and which is shared, and how many clients each has", async ({
  page,
  lab,
  browser,
}) => {
  await page.goto(lab.url);
  await expect(rowOf(page, "webcams")).toContainText("Modeshared");
  await expect(rowOf(page, "webcams")).toContainText(/Clients\d/);
  const before = Number(/Clients\s*(\d+)/.exec(await rowOf(page, "webcams").innerText())?.[1] ?? NaN);
  const viewer = await watchCamera(browser, lab);
  await expect(rowOf(page, "webcams")).toContainText(`Clients${before + 1}`);
  await viewer.close();
  const relay = await startGateway("create", lab.createUrl, webRoot);
  try {
    await page.goto(relay.url);
    await expect(rowOf(page, "create")).toContainText("Moderelay");
    await expect(rowOf(page, "create").locator("details")).toHaveCount(0);
  } finally {
    await relay.program.kill();
  }
});

test("lists the pipes of two viewers as they go on, by keyboard alone", async ({ page, lab, browser }) => {
  await page.goto(lab.url);
  const part = rowOf(page, "webcams").locator("details");
  await part.locator("summary").focus();
  await page.keyboard.press("Enter");
  await expect(part).toContainText("No client listens to a wire or a pipe of it now.");
  const viewers = [await watchCamera(browser, lab), await watchCamera(browser, lab)];
  const table = part.getByRole("table", { name: "Subscriptions of webcams" });
  await expect(table.getByRole("row")).toHaveCount(3);
  await expect(table.getByRole("columnheader")).toHaveText([
    "Member",
    "Client",
    "Delivered",
    "Conflated",
    "Dropped",
    "Age p50",
    "Age p99",
  ]);
  await expect(table.getByRole("rowheader")).toHaveText(Array(2).fill("Webcam.Webcams[0].FrameStream pipe"));
  const clients = await table.locator('[data-label="Client"]').allInnerTexts();
  expect(new Set(clients).size).toBe(2);
  const delivered = table.locator('[data-label="Delivered"]').first();
  const first = Number(await delivered.innerText());
  await expect(async () => expect(Number(await delivered.innerText())).toBeGreaterThan(first)).toPass();
  await expect(table.locator('[data-label="Dropped"]')).toHaveText(["0", "0"]);
  await expect(table.locator('[data-label="Age p99"]').first()).toHaveText(/^[\d.]+ m?s$/);
  for (const viewer of viewers) await viewer.close();
  await expect(part).toContainText("No client listens to a wire or a pipe of it now.");
});

test("asks only while it is open", async ({ page, lab }) => {
  let asked = 0;
  await page.route("**/subscriptions", (route) => (asked++, route.continue()));
  await page.goto(lab.url);
  const part = rowOf(page, "webcams").locator("details");
  await expect(part).toBeVisible();
  expect(asked).toBe(0);
  await part.locator("summary").click();
  await expect(async () => expect(asked).toBeGreaterThanOrEqual(2)).toPass();
  await part.locator("summary").click();
  await expect(part.locator("[data-subscriptions]")).toHaveCount(0);
});

test("says plainly when they may not be seen, when the device is away, and when the gateway is", async ({
  page,
  lab,
}) => {
  const part = rowOf(page, "webcams").locator("details");
  await page.route("**/subscriptions", (route) =>
    route.fulfill({
      status: 403,
      contentType: "application/problem+json",
      body: JSON.stringify({ detail: "vera may not read" }),
    }),
  );
  await page.goto(lab.url);
  await part.locator("summary").click();
  await expect(part.getByRole("status")).toHaveText("You may not see them: vera may not read.");
  await page.unroute("**/subscriptions");
  await expect(part).toContainText("No client listens to a wire or a pipe of it now.");

  await lab.webcams.kill();
  await expect(part).toContainText("The device is away", { timeout: 20_000 });
  lab.webcams.start();
  await expect(part).toContainText("No client listens", { timeout: 20_000 });

  await lab.gateway.kill();
  await expect(part).toContainText(/The gateway has not told them since .*: the gateway cannot be reached\./);
  lab.gateway.start();
  await lab.waitUntilOnline();
  await expect(part).toContainText("No client listens");
});

for (const width of [375, 1280])
  test(`is not wider than a screen of ${width} px`, async ({ page, lab, browser }, info) => {
    const viewer = await watchCamera(browser, lab);
    await page.setViewportSize({ width, height: 900 });
    for (const scheme of ["light", "dark"] as const) {
      await page.emulateMedia({ colorScheme: scheme });
      await page.goto(lab.url);
      await rowOf(page, "webcams").locator("summary").click();
      await expect(rowOf(page, "webcams").getByRole("cell").first()).toBeVisible();
      await expect(rowOf(page, "webcams").getByRole("rowheader")).toHaveCount(1);
      const tooWide = await page.evaluate(
        () => document.documentElement.scrollWidth - document.documentElement.clientWidth,
      );
      expect(tooWide).toBeLessThanOrEqual(0); // below: the gutter of a scroll bar
      await page.screenshot({ path: info.outputPath(`${scheme}.png`), fullPage: true });
      await page.reload();
    }
    await viewer.close();
  });
