// The demo robot: drive, see it move; kill the device, see the page say so; start it, see the page recover.
import { readFileSync } from "node:fs";
import type { Page } from "@playwright/test";
import {
  distance,
  expect,
  open_robot,
  pose_of,
  put_at_start,
  test,
  wait_until_driving,
  wait_until_moved,
  wait_until_still,
  wait_until_stopped,
} from "../lab_test";
import { Line } from "../line";
import { start_gateway, web_root } from "../processes";

test.beforeEach(async ({ page, lab }) => {
  await open_robot(page, lab);
  await put_at_start(page);
});

test("an arrow key drives while it is held", async ({ page }) => {
  const start = await pose_of(page);
  await page.keyboard.down("ArrowUp");
  await expect(page.getByRole("button", { name: "Forward" })).toHaveAttribute("aria-pressed", "true");
  const there = await wait_until_moved(page, start, 0.2);
  await page.keyboard.up("ArrowUp");
  await wait_until_stopped(page);
  expect(there.x).toBeGreaterThan(start.x + 0.19); // it looks east at the start
  await expect(page.locator('[data-reading="distance"]')).not.toHaveText(/^0 /);
});

test("A turns left on the spot", async ({ page }) => {
  const start = await pose_of(page);
  await page.keyboard.down("KeyA");
  await expect(async () => expect((await pose_of(page)).heading).toBeGreaterThan(start.heading + 20)).toPass();
  await page.keyboard.up("KeyA");
  await wait_until_stopped(page);
  const end = await wait_until_still(page);
  expect(distance(start, end)).toBeLessThan(0.01);
});

test("a held button drives, letting go anywhere stops", async ({ page }) => {
  const start = await pose_of(page);
  await page.getByRole("button", { name: "Forward" }).hover();
  await page.mouse.down();
  await wait_until_moved(page, start, 0.1);
  await page.mouse.move(5, 5);
  await page.mouse.up();
  await wait_until_stopped(page);
});

const ends_of_a_held_key: Readonly<Record<string, (page: Page) => Promise<unknown>>> = {
  "the window loses the keyboard": (page) => page.evaluate(() => window.dispatchEvent(new Event("blur"))),
  "the page is hidden": (page) =>
    page.evaluate(() => {
      Object.defineProperty(document, "hidden", { value: true });
      document.dispatchEvent(new Event("visibilitychange"));
    }),
  "the page is left": (page) => page.evaluate(() => window.dispatchEvent(new Event("pagehide"))),
  "a field takes the keyboard": (page) => page.getByRole("slider", { name: "Speed" }).focus(),
  "a shortcut begins": (page) => page.keyboard.down("Control"),
  "Escape is pressed": (page) => page.keyboard.press("Escape"),
  "Space is pressed": (page) => page.keyboard.press("Space"),
  "Stop is pressed": (page) => page.getByRole("button", { name: "Stop" }).click(),
};

for (const [what, end] of Object.entries(ends_of_a_held_key)) {
  test(`a held key stops to drive when ${what}`, async ({ page }) => {
    await page.keyboard.down("ArrowUp");
    await wait_until_driving(page);
    await end(page);
    await wait_until_stopped(page);
  });
}

const ends_of_a_held_button: Readonly<Record<string, (page: Page) => Promise<unknown>>> = {
  "the key is let go": (page) => page.keyboard.up("Enter"),
  "another button takes the keyboard": (page) => page.getByRole("button", { name: "Clear trail" }).focus(),
};

for (const [what, end] of Object.entries(ends_of_a_held_button)) {
  test(`a button held with Enter stops to drive when ${what}`, async ({ page }) => {
    await page.getByRole("button", { name: "Forward" }).focus();
    await page.keyboard.down("Enter");
    await wait_until_driving(page);
    await end(page);
    await wait_until_stopped(page);
  });
}

test("Stop stops a robot that somebody else drives", async ({ page, lab }) => {
  const drive = `${lab.url}api/v1/devices/create/Create/Drive`;
  expect((await page.request.post(drive, { data: { velocity: 100, radius: 32767 } })).ok()).toBe(true);
  await wait_until_driving(page);
  await page.getByRole("button", { name: "Stop" }).click();
  await wait_until_stopped(page);
});

test("letting go stops a robot whose answers do not arrive, while the page says how old its values are", async ({ page, context, lab }) => {
  const line = await Line.to(lab.create_url);
  const { program, url } = await start_gateway("create", line.url, web_root);
  try {
    const watcher = await context.newPage();
    await open_robot(watcher, lab);
    await page.bringToFront();
    await open_robot(page, { url });
    await page.keyboard.down("ArrowUp");
    await wait_until_driving(page);

    line.mute();
    const distance_reading = page.locator('[data-told="distance"]');
    await expect(distance_reading).toContainText(/\d s old/, { timeout: 2_000 });
    await expect(page.getByRole("region", { name: "Chart" })).toContainText(/last known, \d s old/);
    await page.keyboard.up("ArrowUp");
    await wait_until_stopped(watcher, 1_000);
    await expect(page.getByRole("region", { name: "Drive" })).toContainText("RequestTimeout");

    line.unmute();
    await expect(distance_reading).not.toContainText("old");
    await page.keyboard.down("ArrowUp");
    await wait_until_driving(page);
    await page.keyboard.up("ArrowUp");
    await wait_until_stopped(page);
  } finally {
    line.close();
    await program.kill();
  }
});

test("it stops when the page is closed while driving", async ({ page, context, lab }) => {
  const watcher = await context.newPage();
  await open_robot(watcher, lab);
  const start = await pose_of(watcher);
  await page.bringToFront();
  await page.keyboard.down("ArrowUp");
  await wait_until_moved(watcher, start, 0.05);
  await page.close();
  await wait_until_stopped(watcher);
});

test("bumps are logged with their time and the bumpers shown", async ({ page }) => {
  await page.getByRole("slider", { name: "Speed" }).fill("500");
  await page.getByRole("slider", { name: "Speed" }).blur();
  await page.keyboard.down("ArrowUp");
  const log = page.getByRole("region", { name: "Bumps" }).getByRole("listitem");
  await expect(log.first()).toHaveText(/^1\d\d:\d\d:\d\d\.\d{3}/);
  await expect(page.locator('[data-reading="bumpers"]')).not.toHaveText("free");
  await page.keyboard.up("ArrowUp");
});

test("sensor packets and camera pictures arrive", async ({ page }) => {
  await expect(page.locator('[data-reading="packets"]')).toHaveText(/^(1[5-9]|2[0-5]) a second$/);
  const picture = page.getByRole("region", { name: "Camera" }).locator("canvas");
  await expect(async () => {
    const colours = await picture.evaluate((canvas: HTMLCanvasElement) => {
      const pixels = canvas.getContext("2d")?.getImageData(0, 0, canvas.width, canvas.height).data ?? [];
      return { width: canvas.width, distinct: new Set(Array.from(pixels).filter((_, i) => i % 4 === 0)).size };
    });
    expect(colours.width).toBeGreaterThan(4);
    expect(colours.distinct).toBeGreaterThan(3);
  }).toPass();
});

test("a snapshot comes through the camera's memory", async ({ page }) => {
  const camera = page.getByRole("region", { name: "Camera" });
  await camera.getByRole("button", { name: "Snapshot" }).click();
  const saved = page.waitForEvent("download");
  await camera.getByRole("link", { name: "Save it" }).click();
  const file = await (await saved).path();
  expect(readFileSync(file).subarray(1, 4).toString()).toBe("PNG");
});

test("the play button makes the robot ask this page for a song", async ({ page }) => {
  await page.getByRole("button", { name: "Play a song" }).click();
  await expect(page.getByLabel("Song")).toHaveText(/^♪( [A-G]♯?\d){7}$/);
});

test("says when the device is lost, disables driving, and recovers without a reload", async ({ page, lab }) => {
  await page.evaluate(() => ((window as { kept?: boolean }).kept = true));
  const start = await pose_of(page);
  await page.keyboard.down("ArrowUp");
  await wait_until_moved(page, start, 0.1);
  await lab.create.kill();
  await expect(page.locator('[data-link="lost"]')).toContainText("No connection to create since");
  await expect(page.getByRole("button", { name: "Forward" })).toBeDisabled();
  await expect(page.getByRole("button", { name: "Forward" })).toHaveAttribute("aria-pressed", "false");
  await page.keyboard.up("ArrowUp");
  const last_known = await pose_of(page);
  expect(last_known.x).toBeGreaterThan(start.x);

  lab.create.start();
  await expect(page.locator('[data-link="online"]')).toBeVisible({ timeout: 30_000 });
  await expect(page.getByRole("button", { name: "Forward" })).toBeEnabled();
  expect(await page.evaluate(() => (window as { kept?: boolean }).kept)).toBe(true);
  const again = await wait_until_still(page);
  await page.keyboard.down("ArrowUp");
  await wait_until_moved(page, again, 0.1);
  await page.keyboard.up("ArrowUp");
});

test("a gateway that restarts is survived too", async ({ page, lab }) => {
  await lab.gateway.kill();
  await expect(page.locator('[data-link="lost"]')).toContainText("The gateway itself does not answer");
  lab.gateway.start();
  await expect(page.locator('[data-link="online"]')).toBeVisible({ timeout: 30_000 });
  await lab.wait_until_online();
});
