// The page for everybody: by keyboard, in both themes and sizes, in another language, without network.
import { readFileSync } from "node:fs";
import path from "node:path";
import type { Page } from "@playwright/test";
import { expect, test } from "../lab_test";
import { GuardedLab, password } from "../guarded_lab";
import { PANEL_KINDS } from "../../../web/src/board/board";
import { startPeer } from "../peers";
import { repositoryRoot, startTestService, webRoot } from "../processes";

const axe = readFileSync(path.join(repositoryRoot, "web/node_modules/axe-core/axe.min.js"), "utf8");

/** In both colour schemes. */
async function violations(page: Page): Promise<string[]> {
  await page.evaluate(axe); // past the page's policy, as a debugger
  const all: string[] = [];
  for (const colorScheme of ["light", "dark"] as const) {
    await page.emulateMedia({ colorScheme });
    const found = await page.evaluate(async () => {
      const { violations } = await (window as any).axe.run(document, { resultTypes: ["violations"] });
      return violations.map(
        (each: any) =>
          `${each.id}: ${each.nodes
            .map((node: any) => node.html)
            .join(" ")
            .slice(0, 400)}`,
      ) as string[];
    });
    all.push(...found.map((each) => `${colorScheme}: ${each}`));
  }
  return all;
}

for (const [size, viewport] of Object.entries({
  desk: { width: 1280, height: 800 },
  phone: { width: 412, height: 839 },
})) {
  test(`no page has a barrier that axe finds: ${size}`, async ({ page, lab }) => {
    await page.setViewportSize(viewport);
    await page.emulateMedia({ reducedMotion: "reduce" });
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

test("no panel has a barrier that axe finds, whatever its kind", async ({ page }) => {
  test.slow(); // a page for each kind
  const all = await startTestService(webRoot, (url) => ({ devices: [{ name: "big", url }] }));
  const robot = await startPeer("test/interop/peers/standard_robot.py", "robot");
  try {
    await page.emulateMedia({ reducedMotion: "reduce" });
    for (const kind of PANEL_KINDS) {
      const place = ["robot", "trajectory"].includes(kind)
        ? `${robot.url}#/devices/peer/robot`
        : `${all.url}#/devices/big/interop`;
      const board = { board: 1, panels: [{ kind, x: 0, y: 0, w: 6, h: 12 }] };
      const packed = Buffer.from(JSON.stringify(board)).toString("base64url");
      await page.goto(`${place}?view=board&board=${packed}`);
      await page.reload();
      await expect(page.locator('[data-link="online"]')).toBeVisible();
      const content = page.locator(`[data-panel="${kind}"] .panel-body > :is(div, textarea)`);
      await expect(content.first()).toBeVisible();
      expect(await violations(page), kind).toEqual([]);
      await page.getByRole("button", { name: "Arrange" }).click();
      await page.getByRole("button", { name: /^Remove / }).click();
      await expect(page.getByRole("button", { name: "Undo" })).toBeVisible();
      expect(await violations(page), `${kind}, removed`).toEqual([]);
    }
  } finally {
    await Promise.all([all.stop(), robot.stop()]);
  }
});

test("neither the sign-in, the account, a list without devices nor the offline page has a barrier that axe finds", async ({
  page,
}) => {
  const guarded = await GuardedLab.start(webRoot);
  try {
    await page.route("**/api/v1/devices", (route) => route.fulfill({ json: { devices: [] } }));
    await page.emulateMedia({ reducedMotion: "reduce" });
    await page.goto(guarded.url);
    await expect(page.getByRole("form", { name: "Sign in" })).toBeVisible();
    expect(await violations(page), "sign-in").toEqual([]);
    await page.getByLabel("Name").fill("root");
    await page.getByLabel("Password or token").fill(password);
    await page.keyboard.press("Enter");
    await expect(page.getByRole("group", { name: "You" })).toContainText("root admin");
    await expect(page.locator(".empty").first()).toBeVisible();
    expect(await violations(page), "no devices, signed in").toEqual([]);
    await page.goto(`${guarded.url}#/recordings`);
    await expect(page.getByRole("heading", { name: "Recordings" })).toBeVisible();
    expect(await violations(page), "recordings").toEqual([]);
    await page.goto(`${guarded.url}offline.html`);
    await expect(page.getByRole("heading", { name: "The gateway cannot be reached" })).toBeVisible();
    expect(await violations(page), "offline").toEqual([]);
  } finally {
    await guarded.stop();
  }
});

for (const [width, height] of [
  [1920, 1080],
  [3840, 2160],
] as const) {
  test(`nothing is wider than a wall screen: ${width} × ${height}`, async ({ page, lab }) => {
    await page.setViewportSize({ width, height });
    for (const address of [
      "#/",
      "#/recordings",
      "#/devices/create/Create",
      "#/devices/create/Create?view=board",
      "#/devices/create/Create?view=members",
    ]) {
      await page.goto(`${lab.url}${address}`);
      await expect(page.getByRole("main")).toBeVisible();
      if (address.endsWith("board")) await expect(page.locator(".board-panel").first()).toBeVisible();
      if (address.includes("devices")) await expect(page.locator('[data-link="online"]')).toBeVisible();
      const tooWide = await page.evaluate(
        () => document.documentElement.scrollWidth - document.documentElement.clientWidth,
      );
      expect(tooWide, address).toBeLessThanOrEqual(0);
    }
  });
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
      const scrollDown = (): number => {
        window.scrollTo(0, document.documentElement.scrollHeight);
        return scrollY;
      };
      // Again while the view is still loaded, and low.
      await expect.poll(() => page.evaluate(scrollDown), { message: view }).toBeGreaterThan(0);
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
  await page.keyboard.press("Enter");
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

test.describe("with its service worker", () => {
  test.use({ serviceWorkers: "allow" });

  test("can be installed, and says plainly that it is offline", async ({ page, lab, context }) => {
    await page.goto(lab.url);
    const manifest = await page.request.get(`${lab.url}manifest.webmanifest`);
    expect(manifest.headers()["content-type"]).toContain("application/manifest+json");
    const { icons, ...rest } = (await manifest.json()) as { icons: { src: string; type: string; sizes: string }[] };
    expect(rest).toMatchObject({ display: "standalone", start_url: "./" });
    const apple = await page.locator('link[rel="apple-touch-icon"]').getAttribute("href");
    const pictures = icons.filter(({ type }) => type === "image/png");
    expect(pictures.map(({ sizes }) => sizes)).toEqual(["192x192", "512x512"]);
    for (const { src, sizes } of [...pictures, { src: apple ?? "", sizes: "180x180" }]) {
      const picture = await page.request.get(lab.url + src);
      expect(picture.headers()["content-type"]).toBe("image/png");
      const head = (await picture.body()).subarray(16, 24); // of its IHDR
      expect(`${head.readUInt32BE(0)}x${head.readUInt32BE(4)}`).toBe(sizes);
    }
    await page.evaluate(async () => void (await navigator.serviceWorker.ready));
    await context.setOffline(true);
    await page.reload();
    await expect(page.getByRole("heading", { name: "The gateway cannot be reached" })).toBeVisible();
    await context.setOffline(false);
    await page.getByRole("link", { name: /Try again/ }).click();
    await expect(page.getByRole("heading", { name: "Devices" })).toBeVisible();
  });
});

test("a wall screen is used to its edge; what is arranged there is found again, and finds room on a desk", async ({
  page,
  lab,
}) => {
  await page.setViewportSize({ width: 3840, height: 2160 });
  await page.goto(`${lab.url}#/devices/create/Create?view=board`);
  const panels = page.locator(".board-panel");
  await expect(panels.first()).toBeVisible();
  const shape = () =>
    page.locator(".board").evaluate((board) => {
      const places = [...board.querySelectorAll(".board-panel")].map((panel) => panel.getBoundingClientRect());
      const overlap = places.some((a, at) =>
        places.some(
          (b, other) => other < at && a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom,
        ),
      );
      return {
        width: board.clientWidth,
        columns: getComputedStyle(board).gridTemplateColumns.split(" ").length,
        right: Math.max(...places.map(({ right }) => right)),
        overlap,
      };
    });
  const wall = await shape();
  expect(wall).toMatchObject({ columns: 24, overlap: false });
  expect(wall.width).toBeGreaterThan(3700);
  expect(wall.right).toBeGreaterThan(2600);
  const count = await panels.count();

  await page.getByRole("button", { name: "Arrange" }).click();
  const handle = panels.first().getByRole("button", { name: /^Move or size/ });
  await handle.focus();
  for (let step = 0; step < 30; step++) await page.keyboard.press("ArrowRight");
  await page.getByRole("button", { name: "Done" }).click();
  await expect(page.locator('[data-kept="true"]')).toBeVisible();
  const arranged = await shape();
  expect(arranged.overlap).toBe(false);
  expect(arranged.right).toBeGreaterThan(3700);
  await page.reload();
  await expect(panels).toHaveCount(count);
  expect(await shape()).toEqual(arranged);

  const tooWide = () =>
    page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
  for (const [width, columns] of [
    [2560, 18],
    [1280, 12],
  ] as const) {
    await page.setViewportSize({ width, height: 1200 });
    await expect.poll(shape).toMatchObject({ columns, overlap: false });
    await expect(panels).toHaveCount(count);
    expect(await tooWide()).toBeLessThanOrEqual(0);
  }
  await page.setViewportSize({ width: 3840, height: 2160 });
  await expect.poll(shape).toEqual(arranged); // nothing was written meanwhile
});
