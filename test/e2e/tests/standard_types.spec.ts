// Boards of the standard types, at the drivers' base class for robots.
import type { WebSocketRoute } from "@playwright/test";
import { expect, test } from "../lab_test";
import { addPanel } from "../board";
import { startPeer } from "../peers";
import type { Peer } from "../peers";

let robot: Peer;

test.beforeAll(async () => {
  robot = await startPeer("test/interop/peers/standard_robot.py", "robot", {
    mode: "shared",
    leases: { safe: [{ property: "robot.command_mode", value: "halt" }], takeover: ["*"] },
  });
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
  const position = async () => Number.parseFloat(await page.locator('[data-joint="1"] .joint-value').innerText());
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
  await expect(page.locator('[data-joint="0"] .joint-value')).toHaveText("0.0000 rad");
  await page.getByRole("button", { name: "Stop", exact: true }).click();
  await expect(page.locator('[data-stop="arrived"]')).toBeVisible();
  await expect(state).toContainText("halt");
  await expect(forward).toBeDisabled();
});

test("its tool is jogged along an axis of the robot's frame while a button is held, and stopped", async ({ page }) => {
  await page.goto(`${robot.url}#/devices/peer/robot`);
  await page.getByRole("button", { name: "Jog", exact: true }).click();
  const forward = page.getByRole("button", { name: "Y forward", exact: true });
  await expect(forward).toBeEnabled();
  const along = async (axis: string) =>
    Number.parseFloat(await page.locator(`[data-tool="planar"] [data-axis="${axis}"] .joint-value`).innerText());
  const before = await along("Y");
  await forward.focus();
  await page.keyboard.down("Space");
  await expect(async () => expect(await along("Y")).toBeGreaterThan(before + 0.02)).toPass();
  expect(await along("Z")).toBe(0.1);
  await page.keyboard.up("Space");
  let last = NaN;
  await expect(async () => {
    const now = await along("Y");
    const isStill = now === last;
    last = now;
    expect(isStill).toBe(true);
  }).toPass({ intervals: [300] });
  await forward.hover();
  await page.mouse.down();
  await expect(forward).toHaveAttribute("aria-pressed", "true");
  await page.mouse.down({ button: "right" });
  await page.mouse.up();
  await expect(forward).toHaveAttribute("aria-pressed", "false"); // the right button is still down
  await page.mouse.up({ button: "right" });
  await page.getByRole("button", { name: "Halt", exact: true }).click();
  await expect(forward).toBeDisabled();
});

test("the tool of a robot that says that it can't be jogged has its place, and no buttons", async ({ page }) => {
  await page.goto(`${robot.url}#/devices/peer/not_jogged`);
  const tool = page.locator('[data-tool="planar"]');
  await expect(tool.locator('[data-axis="X"] .joint-value')).toHaveText("0.9000 m");
  await expect(page.getByRole("button", { name: "joint_0 forward" })).toBeVisible();
  await expect(tool.getByRole("button")).toHaveCount(0);
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

test("Halt without a connection lets the gateway halt the robot, and says so where it can't", async ({ page }) => {
  const sockets: WebSocketRoute[] = [];
  let isRefused = false;
  await page.routeWebSocket(/devices\/peer/, (socket) => {
    if (isRefused) return void socket.close();
    socket.connectToServer();
    sockets.push(socket);
  });
  await page.goto(`${robot.url}#/devices/peer/robot`);
  const halt = page.getByRole("button", { name: "Halt", exact: true });
  await expect(page.getByRole("list", { name: "State" })).toContainText("halt");
  isRefused = true;
  for (const socket of sockets) await socket.close();
  await expect(page.locator('[data-panel="robot"] [data-stale="true"]')).toBeVisible();
  const mode = `${robot.url}api/v1/devices/peer/robot/command_mode`;
  const read = async () => (await page.request.get(mode)).json();
  const jog = async () => expect((await page.request.put(mode, { data: 1 })).status()).toBe(204);
  await jog();
  await halt.click();
  await expect.poll(read).toBe("halt");
  await expect(page.locator('[data-panel="robot"]')).toContainText("passed on by the gateway after");
  await jog();
  await page.route("**/robot?lease=take*", (route) => route.fulfill({ status: 503, json: { detail: "offline" } }));
  await halt.click();
  await expect(page.locator('[data-panel="robot"]')).toContainText("NOT STOPPED: offline");
  await expect(page.locator('[data-panel="robot"]')).not.toContainText("passed on");
  expect(await read()).toBe("jog");
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

test("a trajectory through waypoints is run with its progress, stopped, and refused where it can't be", async ({
  page,
}) => {
  await page.goto(`${robot.url}#/devices/peer/robot`);
  const panel = page.locator('[data-panel="trajectory"]');
  const field = (name: string) => panel.getByRole("textbox", { name, exact: true });
  const run = panel.getByRole("button", { name: "Run", exact: true });
  const first = page.locator('[data-joint="0"] .joint-value');
  const at = async () => Number.parseFloat(await first.innerText());
  const start = await at();
  await expect(run).toBeDisabled();
  const add = panel.getByRole("button", { name: "Add where the robot is" });
  await add.click();
  await expect(field("Waypoint 1: joint_0")).toHaveValue(String(start));
  await field("Waypoint 1: joint_0").fill(String(start + 0.5));
  await add.click();
  await expect(field("Waypoint 2: seconds")).toHaveValue("4");
  await field("Waypoint 2: seconds").fill("40");
  await field("Waypoint 2: joint_0").fill(String(start + 1.5));
  await run.click();
  await expect(page.getByRole("list", { name: "State" })).toContainText("trajectory");
  await expect(panel.getByRole("progressbar")).toBeVisible();
  await expect(panel).toContainText(/of 40\.0 s, 1 of 2 waypoints/);
  await panel.getByRole("button", { name: "Stop trajectory" }).click();
  await expect(panel.locator('[data-run="stopped"]')).toBeVisible();
  const stopped = await at();
  expect(stopped).toBeGreaterThanOrEqual(start + 0.499);
  expect(stopped).toBeLessThan(start + 1.4);

  await panel.getByRole("button", { name: "Remove 2" }).click();
  await field("Waypoint 1: joint_0").fill("9");
  await run.click();
  await expect(panel.getByRole("alert").filter({ visible: true })).toHaveText(
    "Waypoint 1: joint_0 is 9, its limits are -3 to 3 rad.",
  );
  await field("Waypoint 1: joint_0").fill(String(start));
  await run.click();
  await expect(panel.locator('[data-run="ended"]')).toBeVisible();
  await expect.poll(async () => Math.abs((await at()) - start)).toBeLessThan(0.001);
});
