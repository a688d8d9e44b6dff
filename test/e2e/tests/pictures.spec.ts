// The main pages in three sizes and both colour schemes, compared with the pictures that the documentation shows.
// `npx playwright test pictures --update-snapshots` makes them anew.
import { expect, openRobot, putAtStart, test } from "../lab_test";
import type { Page } from "@playwright/test";

const sizes = {
  desktop: { width: 1280, height: 800 },
  tablet: { width: 820, height: 1180 },
  phone: { width: 390, height: 844 },
};

const pages = {
  devices: async (page: Page, url: string) => {
    await page.goto(url);
    for (const device of ["create", "webcams"])
      await expect(page.locator(`[data-device="${device}"] [data-state="online"]`)).toBeVisible();
  },
  robot: async (page: Page, url: string) => {
    await openRobot(page, { url });
    await putAtStart(page);
    await page.getByRole("button", { name: "Clear trail" }).click();
    await expect(page.getByText("320 × 240")).toBeAttached();
  },
  board: async (page: Page, url: string) => {
    await openRobot(page, { url });
    await putAtStart(page);
    await page.getByRole("link", { name: "Board" }).click();
    await expect(page.getByText("320 × 240")).toBeAttached();
    await expect(
      page
        .getByText(/\d+ a second/)
        .filter({ visible: true })
        .first(),
    ).toBeVisible();
    await page.waitForTimeout(1500); // something to plot
  },
  members: async (page: Page, url: string) => {
    await openRobot(page, { url });
    await page.getByRole("link", { name: "All members" }).click();
    await expect(page.getByRole("heading", { name: "Functions" })).toBeVisible();
  },
};

for (const [name, open] of Object.entries(pages))
  test(`${name} looks as in the documentation`, async ({ page, lab }) => {
    for (const [size, viewport] of Object.entries(sizes)) {
      await page.setViewportSize(viewport);
      await page.emulateMedia({ colorScheme: "light", reducedMotion: "reduce" });
      await open(page, lab.url);
      await page.mouse.move(0, 0);
      await page.evaluate(() => window.scrollTo(0, 0)); // a click may have scrolled to its button
      for (const colorScheme of ["light", "dark"] as const) {
        await page.emulateMedia({ colorScheme });
        // Times, ages and plots differ a little each time.
        const picture = `${name}-${size}-${colorScheme}.png`;
        await expect(async () =>
          expect(await page.screenshot()).toMatchSnapshot(picture, { maxDiffPixelRatio: 0.03 }),
        ).toPass({ timeout: 5_000 });
      }
    }
  });
