// The demo robot: drive, see it move; kill the device, see the page say so; start it, see the page recover.
import { readFileSync } from "node:fs";
import type { Page } from "@playwright/test";
import {
  distance,
  expect,
  openRobot,
  poseOf,
  putAtStart,
  test,
  waitUntilDriving,
  waitUntilMoved,
  waitUntilStill,
  waitUntilStopped,
} from "../lab_test";
import { Line } from "../line";
import { startGateway, webRoot } from "../processes";

test.beforeEach(async ({ page, lab }) => {
  await openRobot(page, lab);
  await putAtStart(page);
});

test("an arrow key drives while it is held", async ({ page }) => {
  const start = await poseOf(page);
  await page.keyboard.down("ArrowUp");
  await expect(page.getByRole("button", { name: "Forward" })).toHaveAttribute("aria-pressed", "true");
  const there = await waitUntilMoved(page, start, 0.2);
  await page.keyboard.up("ArrowUp");
  await waitUntilStopped(page);
  expect(there.x).toBeGreaterThan(start.x + 0.19); // it looks east at the start
  await expect(page.locator('[data-reading="distance"]')).not.toHaveText(/^0 /);
});

test("A turns left on the spot", async ({ page }) => {
  const start = await poseOf(page);
  await page.keyboard.down("KeyA");
  await expect(async () => expect((await poseOf(page)).heading).toBeGreaterThan(start.heading + 20)).toPass();
  await page.keyboard.up("KeyA");
  await waitUntilStopped(page);
  const end = await waitUntilStill(page);
  expect(distance(start, end)).toBeLessThan(0.01);
});

test("a held button drives, letting go anywhere stops", async ({ page }) => {
  const start = await poseOf(page);
  await page.getByRole("button", { name: "Forward" }).hover();
  await page.mouse.down();
  await waitUntilMoved(page, start, 0.1);
  await page.mouse.move(5, 5);
  await page.mouse.up();
  await waitUntilStopped(page);
});

test("a held button is let go of with the left button of the mouse, also while another one is down", async ({
  page,
}) => {
  const start = await poseOf(page);
  await page.getByRole("button", { name: "Forward" }).hover();
  await page.mouse.down();
  await waitUntilMoved(page, start, 0.1);
  await page.mouse.down({ button: "right" });
  await page.mouse.up();
  await waitUntilStopped(page);
  await page.mouse.up({ button: "right" });
});

const endsOfAHeldKey: Readonly<Record<string, (page: Page) => Promise<unknown>>> = {
  "the window loses the keyboard": (page) => page.evaluate(() => window.dispatchEvent(new Event("blur"))),
  "the page is hidden": (page) =>
    page.evaluate(() => {
      Object.defineProperty(document, "hidden", { value: true });
      document.dispatchEvent(new Event("visibilitychange"));
    }),
  "the page is left": (page) => page.evaluate(() => window.dispatchEvent(new Event("pagehide"))),
  "the browser shows its menu": (page) => page.getByText("Hold a button, an arrow key").click({ button: "right" }),
  "a field takes the keyboard": (page) => page.getByRole("slider", { name: "Speed" }).focus(),
  "a shortcut begins": (page) => page.keyboard.down("Control"),
  "Escape is pressed": (page) => page.keyboard.press("Escape"),
  "Space is pressed": async (page) => {
    await page.evaluate(() => (document.activeElement as HTMLElement).blur()); // on a button it is the button's
    await page.keyboard.press("Space");
  },
  "Stop is pressed": (page) => page.getByRole("button", { name: "Stop" }).click(),
};

for (const [what, end] of Object.entries(endsOfAHeldKey)) {
  test(`a held key stops to drive when ${what}`, async ({ page }) => {
    await page.keyboard.down("ArrowUp");
    await waitUntilDriving(page);
    await end(page);
    await waitUntilStopped(page);
  });
}

for (const key of ["Escape", "Space"]) {
  test(`${key} stops a robot that others drive, while the slider of the speed has the keyboard`, async ({
    page,
    lab,
  }) => {
    const drive = `${lab.url}api/v1/devices/create/Create/Drive`;
    expect((await page.request.post(drive, { data: { velocity: 100, radius: 32767 } })).ok()).toBe(true);
    await waitUntilDriving(page);
    await page.getByRole("slider", { name: "Speed" }).focus();
    await page.keyboard.press(key);
    await waitUntilStopped(page);
  });
}

test("Esc by its meaning stops, too; Space and arrows are the page's where they scroll, and where the controls are not shown", async ({
  page,
}) => {
  /** Whether the page has a use for it; `at`: what has the keyboard. */
  const takes = (key: string, code: string, at = "body") =>
    page
      .locator(at)
      .evaluate(
        (target, init) =>
          !target.dispatchEvent(new KeyboardEvent("keydown", { ...init, bubbles: true, cancelable: true })),
        { key, code },
      );
  const drive = page.getByRole("region", { name: "Drive" });
  await page.keyboard.down("ArrowUp");
  await waitUntilDriving(page);
  await takes("Escape", "CapsLock");
  await waitUntilStopped(page);
  await page.keyboard.up("ArrowUp");
  expect([await takes(" ", "Space"), await takes("ArrowDown", "ArrowDown")]).toEqual([true, true]);
  await page.evaluate(() => window.dispatchEvent(new Event("blur")));
  await page.evaluate(() =>
    document.body.insertAdjacentHTML("beforeend", "<summary id=s></summary><ol id=o tabindex=0></ol>"),
  );
  expect([await takes(" ", "Space", "#s"), await takes(" ", "Space", "#o")]).toEqual([false, false]);

  await page.getByRole("link", { name: "All members" }).click();
  await expect(drive).toBeHidden();
  expect([await takes(" ", "Space"), await takes("ArrowDown", "ArrowDown")]).toEqual([false, false]);
  await takes("Escape", "CapsLock");
  await expect(page.locator('[data-stop="arrived"]')).toBeVisible();
});

const endsOfAHeldButton: Readonly<Record<string, (page: Page) => Promise<unknown>>> = {
  "the key is let go": (page) => page.keyboard.up("Enter"),
  "another button takes the keyboard": (page) => page.getByRole("button", { name: "Clear trail" }).focus(),
};

for (const [what, end] of Object.entries(endsOfAHeldButton)) {
  test(`a button held with Enter stops to drive when ${what}`, async ({ page }) => {
    await page.getByRole("button", { name: "Forward" }).focus();
    await page.keyboard.down("Enter");
    await waitUntilDriving(page);
    await end(page);
    await waitUntilStopped(page);
  });
}

test("Stop stops a robot that somebody else drives", async ({ page, lab }) => {
  const drive = `${lab.url}api/v1/devices/create/Create/Drive`;
  expect((await page.request.post(drive, { data: { velocity: 100, radius: 32767 } })).ok()).toBe(true);
  await waitUntilDriving(page);
  await page.getByRole("button", { name: "Stop" }).click();
  await waitUntilStopped(page);
});

test("letting go stops a robot whose answers do not arrive, while the page says how old its values are", async ({
  page,
  context,
  lab,
}) => {
  const line = await Line.to(lab.createUrl);
  const { program, url } = await startGateway("create", line.url, webRoot);
  try {
    const watcher = await context.newPage();
    await openRobot(watcher, lab);
    await page.bringToFront();
    await openRobot(page, { url });
    await page.keyboard.down("ArrowUp");
    await waitUntilDriving(page);

    line.mute();
    const distanceReading = page.locator('[data-told="distance"]');
    await expect(distanceReading).toContainText(/\d s old/, { timeout: 2_000 });
    await expect(page.getByRole("region", { name: "Chart" })).toContainText(/Last known, \d s old/);
    await page.keyboard.up("ArrowUp");
    await waitUntilStopped(watcher, 1_000);
    await expect(page.getByRole("region", { name: "Drive" })).toContainText("RequestTimeout");

    line.unmute();
    await expect(distanceReading).not.toContainText("old");
    await page.keyboard.down("ArrowUp");
    await waitUntilDriving(page);
    await page.keyboard.up("ArrowUp");
    await waitUntilStopped(page);
  } finally {
    line.close();
    await program.kill();
  }
});

test("it stops when the page is closed while driving", async ({ page, context, lab }) => {
  const watcher = await context.newPage();
  await openRobot(watcher, lab);
  const start = await poseOf(watcher);
  await page.bringToFront();
  await page.keyboard.down("ArrowUp");
  await waitUntilMoved(watcher, start, 0.05);
  await page.close();
  await waitUntilStopped(watcher);
});

test("the chart and the line below it fit in a window that grew", async ({ page }) => {
  for (const size of [
    { width: 1280, height: 800 },
    { width: 1440, height: 900 },
    { width: 1920, height: 1080 },
  ]) {
    await page.setViewportSize(size);
    const foot = page.locator(".chart-foot");
    await expect(async () => {
      const { y, height } = (await foot.boundingBox()) ?? { y: Infinity, height: 0 };
      expect(y + height).toBeLessThan(size.height);
    }).toPass({ timeout: 2_000 });
  }
});

test("on a tablet the buttons of the chart stand above the controls", async ({ page }) => {
  await page.setViewportSize({ width: 820, height: 1180 });
  const button = await page.getByRole("button", { name: "Clear trail" }).boundingBox();
  const controls = await page.locator(".drive").boundingBox();
  expect((button?.y ?? NaN) + (button?.height ?? NaN)).toBeLessThanOrEqual(controls?.y ?? NaN);
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

test("a camera that has sent no picture shows none of another one's", async ({ page, lab }) => {
  const camera = page.getByRole("region", { name: "Camera" });
  const width = () => camera.locator("canvas").evaluate((canvas: HTMLCanvasElement) => canvas.width);
  await expect.poll(width).toBe(320);
  const choice = camera.getByRole("combobox", { name: "Camera" });
  const [first, second] = await choice.locator("option").allInnerTexts();
  lab.webcams.signal("SIGSTOP");
  try {
    await choice.selectOption({ label: second ?? "" });
    await expect(camera.getByRole("img", { name: `Picture from camera ${second}` })).toBeVisible();
    await expect(camera).toContainText("Waiting for the first picture");
    expect(await width()).toBe(4); // nothing was drawn
  } finally {
    lab.webcams.signal("SIGCONT");
  }
  await expect.poll(width).toBe(320);
  await choice.selectOption({ label: first ?? "" });
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
  const song = page.getByLabel("Song");
  await expect(song).toHaveText(/^♪( [A-G]♯?\d){7}$/);
  expect(await song.evaluate((element) => element.scrollWidth - element.clientWidth)).toBe(0); // nothing is cut off
});

test("says when the device is lost, disables driving, and recovers without a reload", async ({ page, lab }) => {
  await page.evaluate(() => ((window as { kept?: boolean }).kept = true));
  const start = await poseOf(page);
  await page.keyboard.down("ArrowUp");
  await waitUntilMoved(page, start, 0.1);
  await lab.create.kill();
  await expect(page.locator('[data-link="lost"]')).toContainText("No connection to create since");
  await expect(page.getByRole("button", { name: "Forward" })).toBeDisabled();
  await expect(page.getByRole("button", { name: "Forward" })).toHaveAttribute("aria-pressed", "false");
  await page.keyboard.up("ArrowUp");
  const lastKnown = await poseOf(page);
  expect(lastKnown.x).toBeGreaterThan(start.x);

  lab.create.start();
  await expect(page.locator('[data-link="online"]')).toBeVisible({ timeout: 30_000 });
  await page.getByRole("button", { name: "Take control" }).click(); // the robot's absence took it
  await expect(page.getByRole("button", { name: "Forward" })).toBeEnabled();
  expect(await page.evaluate(() => (window as { kept?: boolean }).kept)).toBe(true);
  const again = await waitUntilStill(page);
  await page.keyboard.down("ArrowUp");
  await waitUntilMoved(page, again, 0.1);
  await page.keyboard.up("ArrowUp");
});

test("a gateway that restarts is survived too", async ({ page, lab }) => {
  await lab.gateway.kill();
  await expect(page.locator('[data-link="lost"]')).toContainText("The gateway itself does not answer");
  lab.gateway.start();
  await expect(page.locator('[data-link="online"]')).toBeVisible({ timeout: 30_000 });
  await lab.waitUntilOnline();
});
