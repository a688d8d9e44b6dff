// The 3-D panel, at the drivers' base class for robots: its picture, and its numbers against those of the driver.
import type { Page } from "@playwright/test";
import { addPanel, arrange } from "../board";
import launch from "../chromium.json" with { type: "json" };
import { expect, test } from "../lab_test";
import { startPeer } from "../peers";
import type { Peer } from "../peers";
import { startTestService, webRoot } from "../processes";

test.use({
  launchOptions: {
    executablePath: process.env["CHROMIUM"] ?? launch.executablePath,
    args: [...launch.args, "--enable-unsafe-swiftshader"],
  },
});

let robot: Peer;

test.beforeAll(async () => {
  robot = await startPeer("test/interop/peers/standard_robot.py", "robot");
});
test.afterAll(async () => robot.stop());

const panel = (page: Page) => page.locator('[data-panel="scene"]');
const frame = (page: Page, name: string) => panel(page).locator(`[data-frame="${name}"]`);

async function numbersOf(page: Page, name: string): Promise<number[]> {
  const text = await frame(page, name).innerText();
  return (text.split(": ")[1] ?? "").split(" ").slice(0, 3).map(Number);
}

test("a robot's joints stand as a chain where the driver says, and the picture moves with them", async ({ page }) => {
  await page.goto(`${robot.url}#/devices/peer/robot`);
  await panel(page).getByText("2 frames").click();
  await expect(frame(page, "planar")).toHaveText("planar: 0.900 0.000 0.100 m");
  await expect(frame(page, "kin_chain_tcp[0]")).toHaveText("kin_chain_tcp[0]: 0.900 0.000 0.100 m");
  await page.getByRole("button", { name: "Jog", exact: true }).click();
  const forward = page.getByRole("button", { name: "joint_1 forward" });
  await expect(forward).toBeEnabled();
  const canvas = panel(page).locator("canvas");
  const before = await canvas.screenshot();
  await forward.focus();
  await page.keyboard.down("Space");
  await expect(async () => expect((await numbersOf(page, "planar"))[1]).toBeGreaterThan(0.05)).toPass();
  await page.keyboard.up("Space");
  await expect(async () => {
    const [ours, theirs] = [await numbersOf(page, "planar"), await numbersOf(page, "kin_chain_tcp[0]")];
    ours.forEach((each, i) => expect(Math.abs(each - (theirs[i] ?? NaN))).toBeLessThan(0.002));
  }).toPass();
  expect((await canvas.screenshot()).equals(before)).toBe(false);
});

test("a laser scanner of the standard types: its scan as points, without those that hit nothing", async ({ page }) => {
  const scanner = await startPeer("test/interop/peers/laser_scanner.py", "scanner");
  try {
    await page.goto(`${scanner.url}#/devices/peer/scanner`);
    await expect(panel(page)).toContainText("350 points");
    const canvas = panel(page).locator("canvas");
    await panel(page).getByRole("button", { name: "From above" }).click();
    const before = await canvas.screenshot();
    await panel(page).getByRole("button", { name: "From the side" }).click();
    await expect(async () => expect((await canvas.screenshot()).equals(before)).toBe(false)).toPass();
  } finally {
    await scanner.stop();
  }
});

const arm = (inside = "") => `<?xml version="1.0"?>
<robot name="planar" xmlns:h="http://www.w3.org/1999/xhtml">${inside}
  <link name="base"><visual><geometry><cylinder radius="0.06" length="0.1"/></geometry></visual></link>
  <link name="upper"><visual><origin xyz="0.25 0 0"/><geometry><box size="0.5 0.06 0.06"/></geometry></visual></link>
  <link name="lower"><visual><geometry><mesh filename="package://planar/lower.stl"/></geometry></visual></link>
  <link name="hand"><visual><geometry><sphere radius="0.05"/></geometry></visual></link>
  <joint name="joint_0" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.1"/><axis xyz="0 0 1"/></joint>
  <joint name="joint_1" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0.5 0 0"/><axis xyz="0 0 1"/></joint>
  <joint name="grip" type="fixed"><parent link="lower"/><child link="hand"/><origin xyz="0.4 0 0"/></joint>
</robot>`;
const file = (text: string, name = "planar.urdf") => ({ name, mimeType: "", buffer: Buffer.from(text) });

test("a robot is shown by a model in URDF from a file, whose joints move with its own; the board keeps it", async ({
  page,
}) => {
  await page.goto(`${robot.url}#/devices/peer/robot`);
  await expect(panel(page).getByText("2 frames")).toBeVisible();
  const canvas = panel(page).locator("canvas");
  await canvas.scrollIntoViewIfNeeded();
  const chain = await canvas.screenshot();
  await arrange(page);
  await panel(page).getByLabel("URDF file").setInputFiles(file(arm()));
  await expect(panel(page)).toContainText("Meshes of the model, which are not shown: 1");
  await arrange(page);
  await panel(page).getByText("6 frames").click();
  const isWhereTheDriverSays = async () => {
    const [ours, theirs] = [await numbersOf(page, "hand"), await numbersOf(page, "kin_chain_tcp[0]")];
    ours.forEach((each, i) => expect(Math.abs(each - (theirs[i] ?? NaN))).toBeLessThan(0.002));
    return ours;
  };
  await expect(async () => void (await isWhereTheDriverSays())).toPass();
  await page.getByRole("button", { name: "Jog", exact: true }).click();
  const back = page.getByRole("button", { name: "joint_1 back" });
  await expect(back).toBeEnabled();
  const before = (await numbersOf(page, "hand"))[1] ?? NaN;
  await back.focus();
  await page.keyboard.down("Space");
  await expect(async () => expect((await numbersOf(page, "hand"))[1]).toBeLessThan(before - 0.05)).toPass();
  await page.keyboard.up("Space");
  await expect(async () => void (await isWhereTheDriverSays())).toPass();

  await page.reload();
  await expect(panel(page).getByText("6 frames")).toBeVisible();
  await canvas.scrollIntoViewIfNeeded();
  expect((await canvas.screenshot()).equals(chain)).toBe(false);
  await arrange(page);
  await panel(page).getByLabel("Model").selectOption("No model");
  await expect(panel(page).getByText("2 frames")).toBeVisible();
});

/** Chromium words an error of XML in a document with styles, and tells of each that the page's policy refuses it. */
const told = test.extend<{ quiet: void }>({ quiet: async ({}, use) => use() });

told("files that are no URDF are refused with the reason; a script in one is not run", async ({ page }) => {
  const dialogs: string[] = [];
  page.on("dialog", (dialog) => void (dialogs.push(dialog.message()), dialog.dismiss()));
  await page.goto(`${robot.url}#/devices/peer/robot`);
  await arrange(page);
  const input = panel(page).getByLabel("URDF file");
  const alert = panel(page).locator(".model-tools").getByRole("alert");
  const circle =
    '<robot><link name="a"/><joint name="j" type="fixed"><parent link="a"/><child link="a"/></joint></robot>';
  for (const [text, reason] of [
    ["<robot", "No URDF can be shown of planar.urdf: the model is no XML: "],
    ['<!DOCTYPE robot [<!ENTITY a "b">]><robot>&a;</robot>', "expected URDF without one"],
    [circle, "the model has 0 links that no joint carries, expected one, the base"],
    ["<robot>" + "<link>".repeat(10_000), "No URDF can be shown of planar.urdf: the model is no XML: "],
    ["x".repeat(100_001), "planar.urdf has 100001 bytes, expected at most 100000"],
  ] as const) {
    await input.setInputFiles(file(text));
    await expect(alert).toContainText(reason);
  }
  await input.setInputFiles(
    file(arm("<h:script>document.title = 'run'</h:script><h:img src='x' onerror='alert(1)'/>")),
  );
  await expect(alert).toBeHidden();
  await expect(panel(page).getByText("6 frames")).toBeVisible();
  await expect(page).not.toHaveTitle("run");
  expect(dialogs).toEqual([]);
});

test("a property that holds URDF is shown as the model", async ({ page }) => {
  const service = await startTestService(webRoot);
  try {
    const headers = { "Content-Type": "application/json" };
    const written = await fetch(`${service.url}api/v1/devices/big/interop/p_string`, {
      method: "PUT",
      headers,
      body: JSON.stringify(arm()),
    });
    expect(written.status).toBe(204);
    await page.goto(`${service.url}#/devices/big/interop?view=board`);
    await addPanel(page, "scene");
    await panel(page).getByLabel("Model").selectOption("p_string");
    await panel(page).getByText("4 frames").click();
    await expect(frame(page, "hand")).toHaveText("hand: 0.900 0.000 0.100 m");
  } finally {
    await service.stop();
  }
});

test("it is looked at from other sides, by buttons and by dragging", async ({ page }) => {
  await page.goto(`${robot.url}#/devices/peer/robot`);
  await expect(panel(page).getByText("2 frames")).toBeVisible();
  const canvas = panel(page).locator("canvas");
  await canvas.scrollIntoViewIfNeeded();
  const pictures = [await canvas.screenshot()];
  for (const name of ["From above", "From the side"]) {
    await panel(page).getByRole("button", { name }).click();
    await expect(async () => {
      const now = await canvas.screenshot();
      expect(pictures.some((each) => each.equals(now))).toBe(false);
      pictures.push(now);
    }).toPass();
  }
  const box = await canvas.boundingBox();
  if (!box) throw new Error("the canvas has no place on the page");
  await page.mouse.move(box.x + 60, box.y + 60);
  await page.mouse.down();
  await page.mouse.move(box.x + 120, box.y + 100, { steps: 4 });
  await page.mouse.up();
  await expect(async () =>
    expect((await canvas.screenshot()).equals(pictures.at(-1) ?? Buffer.of())).toBe(false),
  ).toPass();
});

test("on a touch screen one finger scrolls the page past the picture, two turn it", async ({ browser }) => {
  const context = await browser.newContext({ viewport: { width: 412, height: 700 }, hasTouch: true, isMobile: true });
  const page = await context.newPage();
  await page.goto(`${robot.url}#/devices/peer/robot`);
  await expect(panel(page).getByText("2 frames")).toBeVisible();
  const canvas = panel(page).locator("canvas");
  await canvas.evaluate((element) => element.scrollIntoView({ block: "center" }));
  const scrolled = () => page.evaluate(() => scrollY);
  const fingers = await context.newCDPSession(page);
  const touch = (type: string, touchPoints: { x: number; y: number; id: number }[] = []) =>
    fingers.send("Input.dispatchTouchEvent", { type: type as "touchStart", touchPoints });
  const middle = async () => {
    const box = await canvas.boundingBox();
    if (!box) throw new Error("the canvas has no place on the page");
    return { x: box.x + box.width / 2, y: box.y + box.height / 2 };
  };

  const picture = await canvas.screenshot();
  const { x, y } = await middle();
  const before = await scrolled();
  await touch("touchStart", [{ x, y, id: 0 }]);
  for (let up = 10; up <= 100; up += 10) await touch("touchMove", [{ x, y: y - up, id: 0 }]);
  await touch("touchEnd");
  await expect.poll(scrolled).toBeGreaterThan(before + 50);
  await canvas.evaluate((element) => element.scrollIntoView({ block: "center" }));
  expect((await canvas.screenshot()).equals(picture)).toBe(true);

  const still = await scrolled();
  const at = await middle();
  const pair = (by: number) => [-30, 30].map((aside, id) => ({ x: at.x + aside + by, y: at.y - by, id }));
  await touch("touchStart", pair(0).slice(0, 1));
  await touch("touchStart", pair(0));
  for (let by = 10; by <= 60; by += 10) await touch("touchMove", pair(by));
  await touch("touchEnd");
  await expect(async () => expect((await canvas.screenshot()).equals(picture)).toBe(false)).toPass();
  expect(await scrolled()).toBe(still);
  await context.close();
});

test("a browser without 3-D pictures says so, and has the numbers", async ({ page }) => {
  await page.addInitScript(() => {
    const { getContext } = HTMLCanvasElement.prototype;
    HTMLCanvasElement.prototype.getContext = function (this: HTMLCanvasElement, kind: string, ...more: unknown[]) {
      return kind.startsWith("webgl") ? null : getContext.call(this, kind as "2d", ...(more as []));
    } as typeof getContext;
  });
  await page.goto(`${robot.url}#/devices/peer/robot`);
  await expect(panel(page).getByRole("alert")).toContainText("This browser draws no 3-D pictures");
  await panel(page).getByText("2 frames").click();
  await expect(frame(page, "planar")).toHaveText(/^planar: 0\.\d{3} /);
});

test("three.js is loaded with the first 3-D panel of a board, not before", async ({ page, lab }) => {
  const scripts: string[] = [];
  page.on("request", (request) => void (request.resourceType() === "script" && scripts.push(request.url())));
  await page.goto(`${lab.url}#/devices/webcams/Webcam?view=board`);
  await expect(page.getByRole("button", { name: "Arrange" })).toBeVisible();
  expect(scripts.filter((each) => each.includes("scene_panel"))).toEqual([]);
  await addPanel(page, "scene");
  await expect(panel(page).locator("canvas")).toBeVisible();
  expect(scripts.filter((each) => each.includes("scene_panel"))).toHaveLength(1);
});
