// The page for everybody: by keyboard, in both themes and sizes, in another language, without network.
import { readFileSync } from "node:fs";
import path from "node:path";
import type { Page } from "@playwright/test";
import { expect, test } from "../lab_test";
import { repositoryRoot } from "../processes";

const axe = readFileSync(path.join(repositoryRoot, "web/node_modules/axe-core/axe.min.js"), "utf8");

async function violations(page: Page): Promise<string[]> {
  await page.evaluate(axe); // past the page's policy, as a debugger
  return page.evaluate(async () => {
    const { violations: found } = await (window as any).axe.run(document, { resultTypes: ["violations"] });
    return found.map(
      (each: any) =>
        `${each.id}: ${each.nodes
          .map((node: any) => node.html)
          .join(" ")
          .slice(0, 400)}`,
    );
  });
}

for (const colorScheme of ["light", "dark"] as const) {
  for (const [size, viewport] of Object.entries({
    desk: { width: 1280, height: 800 },
    phone: { width: 412, height: 839 },
  })) {
    test(`no page has a barrier that axe finds: ${colorScheme}, ${size}`, async ({ page, lab }) => {
      await page.setViewportSize(viewport);
      await page.emulateMedia({ colorScheme, reducedMotion: "reduce" });
      for (const address of [
        "#/",
        "#/devices/create/Create",
        "#/devices/create/Create?view=board",
        "#/devices/create/Create?view=members",
      ]) {
        await page.goto(`${lab.url}${address}`);
        await expect(page.locator('[data-state="online"]').first()).toBeVisible();
        if (address.endsWith("board")) {
          await expect(page.locator('[data-panel="plot"] .freshness').first()).toContainText("a second");
          await page.getByRole("button", { name: "Arrange" }).click();
        }
        expect(await violations(page), address).toEqual([]);
        const tooWide = await page.evaluate(
          () => document.documentElement.scrollWidth - document.documentElement.clientWidth,
        );
        expect(tooWide, address).toBeLessThanOrEqual(0);
      }
    });
  }
}

for (const [size, viewport] of Object.entries({
  phone: { width: 390, height: 844 },
  "phone on its side": { width: 844, height: 390 },
  tablet: { width: 1024, height: 768 },
})) {
  test(`Stop is in reach wherever a page is scrolled to, and nothing is wider than the screen: ${size}`, async ({
    page,
    lab,
  }) => {
    await page.setViewportSize(viewport);
    for (const view of ["drive", "board", "members"]) {
      await page.goto(`${lab.url}#/devices/create/Create?view=${view}`);
      await expect(page.locator('[data-link="online"]')).toBeVisible();
      const stop = page.getByRole("button", { name: "Stop", exact: true });
      await expect(stop, view).toBeInViewport({ ratio: 1 });
      await page.evaluate(() => window.scrollTo(0, document.documentElement.scrollHeight));
      await expect.poll(() => page.evaluate(() => scrollY), { message: view }).toBeGreaterThan(0);
      await expect(stop, view).toBeInViewport({ ratio: 1 });
      expect(await page.evaluate(() => document.documentElement.scrollWidth - innerWidth), view).toBeLessThanOrEqual(0);
      await stop.click(); // nothing lies over it
    }
  });
}

test("a board is made by keyboard alone", async ({ page, lab }) => {
  await page.goto(`${lab.url}#/devices/webcams/Webcam?view=board`);
  await expect(page.locator(".board-panel").first()).toBeVisible();
  await page.getByRole("button", { name: "Arrange" }).focus();
  await page.keyboard.press("Tab");
  await page.keyboard.type("Notes");
  await page.keyboard.press("Tab");
  await page.keyboard.press("Enter");
  await expect(page.locator('[data-panel="notes"]')).toBeVisible();
  await page
    .locator('[data-panel="notes"]')
    .getByRole("button", { name: /^Move or size/ })
    .focus();
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("Shift+ArrowDown");
  await page.keyboard.press("Tab");
  await page.keyboard.type("Morning shift");
  await expect(page.getByRole("group", { name: "Morning shift" })).toBeVisible();
});

test("the page speaks German to a German browser, and English again where that is chosen", async ({ browser, lab }) => {
  const context = await browser.newContext({ locale: "de-DE" });
  const page = await context.newPage();
  await page.goto(`${lab.url}#/devices/create/Create?view=board`);
  await expect(page.locator("html")).toHaveAttribute("lang", "de");
  await expect(page.getByRole("button", { name: "Anordnen" })).toBeVisible();
  await expect(page.getByRole("button", { name: "Stopp", exact: true })).toBeVisible();
  await expect(page.locator('[data-panel="plot"] .freshness').first()).toContainText("je Sekunde");
  await page.getByLabel("Sprache").selectOption("en");
  await expect(page.getByRole("button", { name: "Arrange" })).toBeVisible();
  await context.close();
});

test("can be installed, and says plainly that it is offline", async ({ page, lab, context }) => {
  await page.goto(lab.url);
  const manifest = await page.request.get(`${lab.url}manifest.webmanifest`);
  expect(manifest.headers()["content-type"]).toContain("application/manifest+json");
  expect(await manifest.json()).toMatchObject({ display: "standalone", start_url: "./" });
  await page.evaluate(async () => void (await navigator.serviceWorker.ready));
  await context.setOffline(true);
  await page.reload();
  await expect(page.getByRole("heading", { name: "The gateway cannot be reached" })).toBeVisible();
  await context.setOffline(false);
  await page.getByRole("link", { name: /Try again/ }).click();
  await expect(page.getByRole("heading", { name: "Devices" })).toBeVisible();
});
