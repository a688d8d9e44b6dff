// Boards of the standard types, at the drivers' base class for robots.
import { expect, test } from "../lab_test";
import { addPanel } from "../board";
import { startPeer } from "../peers";
import type { Peer } from "../peers";

let robot: Peer;

test.beforeAll(async () => {
  robot = await startPeer("test/interop/peers/standard_robot.py", "robot", /ready/);
});
test.afterAll(async () => robot.stop());

test("a standard robot: its state in words, a joint jogged while a button is held, and stopped", async ({ page }) => {
  await page.goto(`${robot.url}#/devices/peer/robot`);
  const state = page.getByRole("list", { name: "State" });
  await expect(state).toContainText("ready");
  await expect(state).toContainText("cobot");
  await expect(state).toContainText("halt");
  const forward = page.getByRole("button", { name: "joint_1 forward" });
  await expect(forward).toBeDisabled();
  await expect(page.getByRole("meter", { name: "joint_1" })).toHaveAttribute("max", "3");
  await page.getByRole("button", { name: "Jog", exact: true }).click();
  await expect(state).toContainText("jog");
  const position = async () => Number.parseFloat(await page.locator('[data-position="1"]').innerText());
  expect(await position()).toBe(0);
  await forward.focus();
  await page.keyboard.down("Space");
  await expect(async () => expect(await position()).toBeGreaterThan(0.02)).toPass();
  await page.keyboard.up("Space");
  let last = NaN;
  await expect(async () => {
    const now = await position();
    const isStill = now === last;
    last = now;
    expect(isStill).toBe(true);
  }).toPass({ intervals: [300] });
  await expect(page.locator('[data-position="0"]')).toHaveText("0 rad");
  await page.getByRole("button", { name: "Stop", exact: true }).click();
  await expect(page.locator('[data-stop="arrived"]')).toBeVisible();
  await expect(state).toContainText("halt");
  await expect(forward).toBeDisabled();
});

test("Halt stops as Stop does, and no jogging begins behind it", async ({ page }) => {
  await page.goto(`${robot.url}#/devices/peer/robot`);
  const state = page.getByRole("list", { name: "State" });
  await page.getByRole("button", { name: "Jog", exact: true }).click();
  await expect(state).toContainText("jog");
  await page.getByRole("button", { name: "Halt", exact: true }).click();
  await expect(state).toContainText("halt");
  robot.device.signal("SIGSTOP"); // what is sent now is answered late
  try {
    await page.getByRole("button", { name: "Jog", exact: true }).click();
    await page.getByRole("button", { name: "Halt", exact: true }).click();
  } finally {
    robot.device.signal("SIGCONT");
  }
  await expect(page.getByRole("button", { name: "Jog", exact: true })).toBeEnabled(); // its sequence is over
  await expect(state).toContainText("halt");
  await expect(page.getByRole("button", { name: "joint_0 forward" })).toBeDisabled();
});

test("a robot that freezes is no longer jogged, and its state is marked old", async ({ page }) => {
  await page.goto(`${robot.url}#/devices/peer/robot`);
  await page.getByRole("button", { name: "Jog", exact: true }).click();
  const forward = page.getByRole("button", { name: "joint_0 forward" });
  await expect(forward).toBeEnabled();
  robot.device.signal("SIGSTOP");
  try {
    await expect(forward).toBeDisabled({ timeout: 1_500 });
    await expect(page.locator('[data-panel="robot"] [data-stale="true"]')).toBeVisible();
    await page.keyboard.press("Escape");
    await expect(page.locator('[data-stop="sent"]')).toBeVisible();
  } finally {
    robot.device.signal("SIGCONT");
  }
  await expect(page.locator('[data-stop="arrived"]')).toBeVisible();
  await expect(page.getByRole("list", { name: "State" })).toContainText("halt");
});

test("structs of structs are filled in, and a trajectory's generator says what is wrong with it", async ({ page }) => {
  await page.goto(`${robot.url}#/devices/peer/robot`);
  await addPanel(page, "generator");
  const generator = page.locator('[data-panel="generator"]');
  await generator.getByLabel("Member").selectOption("execute_trajectory");
  await expect(generator.getByText("joint_names").first()).toBeVisible();
  await generator.getByRole("button", { name: "Step", exact: true }).click();
  await expect(generator.getByRole("alert")).toContainText(/Exception|Error|RobotRaconteur/);
});
