// The teleop panel at the demo robot: what the robot was told is read at the robot.
import type { Page } from "@playwright/test";
import { expect, test } from "../lab_test";
import { startTestService, webRoot } from "../processes";
import type { Lab } from "../processes";
import { addPanel, arrange } from "../board";

const pad = (page: Page) => page.locator(".teleop-pad");
const command = (page: Page) => page.locator('[data-teleop="command"]');

async function speedOf(lab: Lab): Promise<number> {
  const state = (await (await fetch(`${lab.url}api/v1/devices/create/Create/state`)).json()) as { velocity: number };
  return state.velocity;
}

const expectSpeed = (lab: Lab, speed: number) =>
  expect.poll(() => speedOf(lab), { intervals: [20], timeout: 5_000 }).toBeCloseTo(speed, 3);

const pushGamepad = (page: Page, up: number, mapping = "standard") =>
  page.evaluate(
    ([y, mapping]) => Object.assign(window, { pads: [{ id: "Pad", connected: true, mapping, axes: [0, -y, 0, 0] }] }),
    [up, mapping] as const,
  );

/** Forward, by the left stick, 50 mm/s at most. */
const settings = {
  member: "Drive",
  axes: [{ stick: "left-y", path: "velocity", scale: 50, deadZone: 0.1 }],
  neutral: { velocity: "0", radius: "32767" },
};

test.beforeEach(async ({ page, lab }) => {
  await page.addInitScript(() => {
    Object.assign(window, { pads: [] });
    navigator.getGamepads = () => (window as unknown as { pads: Gamepad[] }).pads;
  });
  const board = { board: 1, panels: [{ kind: "teleop", x: 0, y: 0, w: 6, h: 12, settings }] };
  const packed = Buffer.from(JSON.stringify(board)).toString("base64url");
  await page.goto(`${lab.url}#/devices/create/Create?view=board&board=${packed}`);
  await arrange(page);
  await expect(command(page)).toHaveText("0,32767");
});

test("what an axis sets, by how much, and what is sent at rest are typed in; a key drives by them", async ({
  page,
  lab,
}) => {
  await page.getByRole("button", { name: "Remove Drive" }).click();
  await addPanel(page, "teleop");
  const panel = page.locator('[data-panel="teleop"]');
  await panel.getByLabel("Member").selectOption("Drive");
  await panel.getByRole("button", { name: "Add axis" }).click();
  await panel.getByLabel("Number of axis 1").fill("speed");
  await panel.getByLabel("Number of axis 1").blur();
  await expect(panel.getByRole("alert")).toContainText('"speed" is no number of int16 velocity, int16 radius');
  await panel.getByLabel("Number of axis 1").fill("velocity");
  const scale = panel.getByLabel("Scale of axis 1");
  await scale.fill("");
  await scale.pressSequentially("-0.5"); // no number yet after the first, and the third
  await expect(scale).toHaveValue("-0.5");
  await scale.fill("0,5");
  await scale.blur();
  await expect(scale).toHaveValue("0.5");
  await scale.fill("");
  await scale.pressSequentially("1x");
  await scale.blur();
  await expect(scale).toHaveValue("0.5");
  await scale.fill("50");
  await panel.getByLabel("radius at rest").fill("32767");
  await panel.getByLabel("radius at rest").blur();
  await expect(command(page)).toHaveText("0,32767");
  await pad(page).focus();
  await page.keyboard.down("KeyW");
  await expectSpeed(lab, 0.05);
  await page.keyboard.up("KeyW");
  await expectSpeed(lab, 0);
});

test("a key drives while it is held, and letting go stops at once", async ({ page, lab }) => {
  await pad(page).focus();
  await page.keyboard.down("KeyW");
  await expect(command(page)).toHaveText("50,32767");
  await expectSpeed(lab, 0.05);
  await expect(page.locator('[data-panel="teleop"] [data-control="held"]')).toBeVisible();
  await page.keyboard.up("KeyW");
  await expectSpeed(lab, 0);
});

const ends: Readonly<Record<string, (page: Page) => Promise<unknown>>> = {
  "the pad loses the keyboard": (page) => page.getByRole("button", { name: "Done" }).focus(),
  "the window loses the keyboard": (page) => page.evaluate(() => window.dispatchEvent(new Event("blur"))),
  "a shortcut begins": (page) => page.keyboard.down("Control"),
  "Rest is pressed": (page) => pad(page).getByRole("button", { name: "Rest" }).click(),
  "Escape is pressed": (page) => page.keyboard.press("Escape"),
  "control is given back": (page) =>
    page.locator('[data-panel="teleop"]').getByRole("button", { name: "Give back" }).click(),
  "the panel is removed": (page) => page.getByRole("button", { name: "Remove Drive" }).click(),
};

for (const [what, end] of Object.entries(ends)) {
  test(`a held key no longer drives when ${what}`, async ({ page, lab }) => {
    await pad(page).getByRole("button", { name: "Rest" }).focus(); // a part of the pad has the keyboard
    await page.keyboard.down("KeyS");
    await expectSpeed(lab, -0.05);
    await end(page);
    await expectSpeed(lab, 0);
    await page.waitForTimeout(300); // three repetitions of what is held
    expect(await speedOf(lab)).toBe(0);
  });
}

test("a robot that was away is driven again by who takes control by hand, and by nobody before", async ({
  page,
  lab,
}) => {
  const panel = page.locator('[data-panel="teleop"]');
  const control = panel.locator("[data-control]");
  await pad(page).focus();
  await page.keyboard.down("KeyW");
  await expectSpeed(lab, 0.05);
  await lab.create.kill();
  await expect(control).toHaveAttribute("data-control", "lost", { timeout: 1_000 });
  await expect(page.locator('[data-link="lost"]')).toBeVisible();
  await expect(control).toHaveAttribute("data-control", "lost");
  await expect(panel.getByRole("button", { name: "Take control" })).toBeDisabled();
  lab.create.start();
  await lab.waitUntilOnline();
  await expect(page.locator('[data-link="online"]')).toBeVisible({ timeout: 30_000 });
  await expect(panel.getByRole("button", { name: "Take control" })).toBeEnabled();
  await expect(control).toHaveAttribute("data-control", "lost");
  await pad(page).focus();
  await page.keyboard.up("KeyW");
  await page.keyboard.down("KeyW");
  await expectSpeed(lab, 0);
  await expect(control).toHaveAttribute("data-control", "lost");
  await page.keyboard.up("KeyW");
  await panel.getByRole("button", { name: "Take control" }).click();
  await expect(control).toHaveAttribute("data-control", "held");
  await pad(page).focus();
  await page.keyboard.down("KeyW");
  await expectSpeed(lab, 0.05);
  await page.keyboard.up("KeyW");
  await expectSpeed(lab, 0);
});

test("a stick on the screen drives as far as it is pushed, and springs back", async ({ page, lab }) => {
  const box = (await page.getByLabel("Left stick").boundingBox())!;
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width / 2, box.y);
  await expectSpeed(lab, 0.05);
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await expectSpeed(lab, 0);
  await page.mouse.move(box.x + box.width / 2, box.y + 3 * box.height);
  await expectSpeed(lab, -0.05);
  await page.mouse.down({ button: "right" });
  await page.mouse.up(); // the browser tells of it by a move: another button is down
  await expectSpeed(lab, 0);
  await page.mouse.up({ button: "right" });
});

test("a stick on the screen that is still held drives no more after Escape, until it is pressed anew", async ({
  page,
  lab,
}) => {
  const box = (await page.getByLabel("Left stick").boundingBox())!;
  const middle = { x: box.x + box.width / 2, y: box.y + box.height / 2 };
  await page.mouse.move(middle.x, middle.y);
  await page.mouse.down();
  await page.mouse.move(middle.x, box.y);
  await expectSpeed(lab, 0.05);
  await page.keyboard.press("Escape");
  await expectSpeed(lab, 0);
  await page.mouse.move(middle.x, box.y + 1);
  await page.mouse.move(middle.x, box.y + 2);
  await page.waitForTimeout(300); // three repetitions of what is held
  expect(await speedOf(lab)).toBe(0);
  await page.mouse.up();
  await page.mouse.move(middle.x, middle.y);
  await page.mouse.down();
  await page.mouse.move(middle.x, box.y - box.height);
  await expectSpeed(lab, 0.05);
  await page.mouse.up();
  await expectSpeed(lab, 0);
});

test("a gamepad that is still pushed drives no more after Stop, until it was in the middle", async ({ page, lab }) => {
  const push = (up: number) => pushGamepad(page, up);
  await push(0);
  await expect(page.locator('[data-gamepad="true"]')).toBeVisible();
  await page.locator('[data-panel="teleop"]').getByRole("button", { name: "Take control" }).click();
  for (const stop of ["Stop", "Rest"]) {
    await push(1);
    await expectSpeed(lab, 0.05);
    await page.getByRole("button", { name: stop, exact: true }).click();
    await expectSpeed(lab, 0);
    await push(0.9);
    await page.waitForTimeout(300); // three repetitions of what is held
    expect(await speedOf(lab)).toBe(0);
    await push(0);
    await expect(command(page)).toHaveText("0,32767");
    await page.waitForTimeout(100); // a few frames: the page has seen it in the middle
  }
  await push(1);
  await expectSpeed(lab, 0.05);
  await push(0);
  await expectSpeed(lab, 0);
});

test("a gamepad drives once one is in control, past its dead zone", async ({ page, lab }) => {
  const push = (up: number) => pushGamepad(page, up);
  await push(1);
  await expect(page.locator('[data-gamepad="true"]')).toBeVisible();
  await page.locator('[data-panel="teleop"]').getByRole("button", { name: "Take control" }).click();
  await page.waitForTimeout(200); // pushed since before it was seen
  expect(await speedOf(lab)).toBe(0);
  await push(0);
  await page.waitForTimeout(100); // a few frames: the page has seen it in the middle
  await push(1);
  await expectSpeed(lab, 0.05);
  await push(0.54);
  await expectSpeed(lab, 0.024);
  await push(0.08);
  await expectSpeed(lab, 0);
  await push(1);
  await expectSpeed(lab, 0.05);
  await page.evaluate(() => Object.assign(window, { pads: [] })); // it is unplugged
  await expectSpeed(lab, 0);
});

test("a gamepad whose axes the browser does not know is ignored, and the panel says so", async ({ page, lab }) => {
  await page.locator('[data-panel="teleop"]').getByRole("button", { name: "Take control" }).click();
  await pushGamepad(page, 0, "");
  await expect(page.locator('[data-panel="teleop"]')).toContainText("Pad is ignored");
  await page.waitForTimeout(100); // a few frames: the page has seen it in the middle
  await pushGamepad(page, 1, "");
  await page.waitForTimeout(300); // three repetitions of what is held
  expect(await speedOf(lab)).toBe(0);
});

test("one gamepad drives the members of several panels, each by axes of its own", async ({ page }) => {
  const service = await startTestService(webRoot);
  try {
    const members = { p_double: { stick: "left-y", scale: 4 }, p_int32: { stick: "right-x", scale: -7 } } as const;
    const panels = Object.entries(members).map(([member, axis], i) => ({
      ...{ kind: "teleop", x: 6 * i, y: 0, w: 6, h: 12 },
      settings: { member, axes: [{ ...axis, path: member, deadZone: 0.1 }], neutral: ["0"] },
    }));
    const packed = Buffer.from(JSON.stringify({ board: 1, panels })).toString("base64url");
    await page.goto(`${service.url}#/devices/big/interop?view=board&board=${packed}`);
    await expect(page.locator('[data-link="online"]')).toBeVisible();
    const push = (axes: number[]) =>
      page.evaluate((all) => {
        Object.assign(window, { pads: [{ id: "Pad", connected: true, mapping: "standard", axes: all }] });
      }, axes);
    await push([0, 0, 0, 0]);
    await expect(page.locator('[data-gamepad="true"]')).toHaveCount(2);
    await page.locator('[data-panel="teleop"]').first().getByRole("button", { name: "Take control" }).click();
    const values = () =>
      Promise.all(
        Object.keys(members).map(async (member) =>
          (await page.request.get(`${service.url}api/v1/devices/big/interop/${member}`)).json(),
        ),
      );
    await push([0, -1, 0, 0]);
    await expect.poll(values).toEqual([4, 0]);
    await push([0, -1, 1, 0]);
    await expect.poll(values).toEqual([4, -7]);
    await push([0, 0, 1, 0]);
    await expect.poll(values).toEqual([0, -7]);
    await page.request.put(`${service.url}api/v1/devices/big/interop/p_double`, { data: 1 }); // by somebody else
    for (const [at, value] of [
      [0, 0],
      [-1, 7],
      [0, 0],
    ] as const) {
      await push([0, 0, at, 0]);
      await expect.poll(values).toEqual([1, value]);
    }
  } finally {
    await service.stop();
  }
});
