// The right to command, as the pages show it: taken with the first command, refused, taken over, lost, given back.
import type { Page, WebSocketRoute } from "@playwright/test";
import { addPanel } from "../board";
import { expect, openRobot, putAtStart, test, waitUntilDriving, waitUntilStopped } from "../lab_test";
import { startGateway, webRoot } from "../processes";

const control = (page: Page) => page.locator("[data-control]");
const forward = (page: Page) => page.getByRole("button", { name: "Forward" });

/** For longer than the gateway waits for a page that has control. */
const hang = (page: Page) =>
  page.evaluate(() => {
    const until = Date.now() + 1500;
    while (Date.now() < until);
  });

test.beforeEach(async ({ page, lab }) => {
  await openRobot(page, lab);
  await putAtStart(page);
});

test("the first command takes control, which can be given back", async ({ page }) => {
  await expect(control(page)).toHaveAttribute("data-control", "idle");
  await page.keyboard.down("ArrowUp");
  await waitUntilDriving(page);
  await page.keyboard.up("ArrowUp");
  await waitUntilStopped(page);
  await expect(control(page)).toContainText("You are in control since");
  await page.getByRole("button", { name: "Give back" }).click();
  await expect(control(page)).toHaveAttribute("data-control", "idle");
});

test("a key that is held when control is given back is held no more", async ({ page }) => {
  await page.keyboard.down("ArrowUp");
  await waitUntilDriving(page);
  await expect(forward(page)).toHaveAttribute("aria-pressed", "true");
  await page.getByRole("button", { name: "Give back" }).click();
  await waitUntilStopped(page);
  await expect(forward(page)).toHaveAttribute("aria-pressed", "false");
  await expect(control(page)).toHaveAttribute("data-control", "idle");
  await page.keyboard.up("ArrowUp");
});

test("who has control keeps others out until they take over, who is told then and stops", async ({
  page,
  context,
  lab,
}) => {
  await page.keyboard.down("ArrowUp");
  await waitUntilDriving(page);
  const other = await context.newPage();
  await openRobot(other, lab);
  await other.keyboard.down("ArrowDown");
  await expect(control(other)).toHaveAttribute("data-control", "lost");
  await other.keyboard.up("ArrowDown");
  await waitUntilDriving(other);
  await expect(forward(other)).toBeDisabled();

  await other.getByRole("button", { name: "Take over" }).click();
  await expect(control(other)).toHaveAttribute("data-control", "held");
  await waitUntilStopped(other);
  await expect(control(page)).toContainText("taken over");
  await expect(forward(page)).toBeDisabled();
  await expect(forward(other)).toBeEnabled();
  await other.close();
});

test("Stop stops a robot that another page has in control", async ({ page, context, lab }) => {
  const other = await context.newPage();
  await openRobot(other, lab);
  await other.bringToFront();
  await other.keyboard.down("ArrowUp");
  await waitUntilDriving(other);
  await page.getByRole("button", { name: "Stop" }).click();
  await waitUntilStopped(page, 1_000);
  await expect(control(other)).toHaveAttribute("data-control", "lost");
  await other.close();
});

test("Stop stops the robot also where control was lost to others", async ({ page, context, lab }) => {
  const other = await context.newPage();
  await openRobot(other, lab);
  await other.bringToFront();
  await other.keyboard.down("ArrowUp");
  await waitUntilDriving(other);
  await page.bringToFront();
  await page.keyboard.press("ArrowDown");
  await expect(control(page)).toHaveAttribute("data-control", "lost");
  await expect(forward(page)).toBeDisabled();
  await expect(page.getByRole("button", { name: "Stop" })).toBeEnabled();
  await page.getByRole("button", { name: "Stop" }).click();
  await waitUntilStopped(page, 1_000);
  await other.close();
});

test("the list of all members has a Stop, too", async ({ page, lab }) => {
  const robot = `${lab.url}api/v1/devices/create/Create/`;
  expect((await page.request.post(`${robot}Drive`, { data: { velocity: 100, radius: 32767 } })).ok()).toBe(true);
  await waitUntilDriving(page);
  await page.getByRole("link", { name: "All members" }).click();
  await page.getByRole("button", { name: "Stop", exact: true }).click();
  await expect(page.locator('[data-stop="arrived"]')).toBeVisible();
  const velocity = async () =>
    ((await (await page.request.get(`${robot}state`)).json()) as { velocity: number }).velocity;
  await expect.poll(velocity, { timeout: 1_000 }).toBe(0); // the robot says 20 times a second what it does
});

test("a page that hangs while it drives is out of control and stays so until it is taken by hand", async ({ page }) => {
  await page.keyboard.down("ArrowUp");
  await waitUntilDriving(page);
  await hang(page);
  await expect(control(page)).toContainText("has not renewed it");
  await waitUntilStopped(page);
  await expect(forward(page)).toBeDisabled();
  await page.keyboard.up("ArrowUp");
  await page.getByRole("button", { name: "Take" }).click();
  await expect(control(page)).toHaveAttribute("data-control", "held");
  await expect(forward(page)).toBeEnabled();
});

test("control that went with the device is lost at once, and comes back by hand alone", async ({ page, lab }) => {
  await page.keyboard.down("ArrowUp");
  await waitUntilDriving(page);
  await expect(control(page)).toHaveAttribute("data-control", "held");
  await lab.create.kill();
  await expect(control(page)).toHaveAttribute("data-control", "lost", { timeout: 1_000 });
  await expect(page.locator('[data-link="lost"]')).toBeVisible();
  await expect(control(page)).toHaveAttribute("data-control", "lost");
  await expect(page.getByRole("button", { name: "Take control" })).toBeDisabled(); // there is nothing to command
  await page.keyboard.up("ArrowUp");
  lab.create.start();
  await lab.waitUntilOnline();
  await expect(page.locator('[data-link="online"]')).toBeVisible({ timeout: 30_000 });
  await expect(page.getByRole("button", { name: "Take control" })).toBeEnabled();
  await page.keyboard.press("ArrowUp");
  await expect(control(page)).toHaveAttribute("data-control", "lost");
  await expect(forward(page)).toBeDisabled();
  await page.getByRole("button", { name: "Take control" }).click();
  await expect(control(page)).toHaveAttribute("data-control", "held");
  await page.keyboard.down("ArrowUp");
  await waitUntilDriving(page);
  await page.keyboard.up("ArrowUp");
  await waitUntilStopped(page);
});

test("control that went with the connection comes back by hand alone", async ({ page }) => {
  const sockets: WebSocketRoute[] = [];
  await page.routeWebSocket(/devices\/create/, (socket) => {
    socket.connectToServer();
    sockets.push(socket);
  });
  await page.reload();
  await expect(forward(page)).toBeEnabled();
  await page.keyboard.down("ArrowUp");
  await waitUntilDriving(page);
  await page.keyboard.up("ArrowUp");
  await expect(control(page)).toHaveAttribute("data-control", "held");
  for (const socket of sockets.splice(0)) await socket.close();
  await expect.poll(() => sockets.length).toBeGreaterThan(0); // it connects again
  await expect(page.locator('[data-link="online"]')).toBeVisible();
  await expect(control(page)).toHaveAttribute("data-control", "lost");
  await page.keyboard.press("ArrowUp");
  await expect(control(page)).toHaveAttribute("data-control", "lost");
  await page.getByRole("button", { name: "Take control" }).click();
  await expect(control(page)).toHaveAttribute("data-control", "held");
});

test("Stop stops the robot where control was lost and nobody may take it over", async ({ page, lab }) => {
  const leases = { safe: [{ call: "Create.Drive", arguments: [0, 0] }] };
  const devices = [{ name: "create", url: lab.createUrl, mode: "shared", leases }];
  const { program, url } = await startGateway("create", lab.createUrl, webRoot, { devices });
  try {
    await openRobot(page, { url });
    await page.keyboard.down("ArrowUp");
    await waitUntilDriving(page);
    await hang(page);
    await page.keyboard.up("ArrowUp");
    await expect(control(page)).toHaveAttribute("data-control", "lost");
    await waitUntilStopped(page);
    const robot = `${url}api/v1/devices/create/Create/`;
    expect((await page.request.post(`${robot}Drive`, { data: { velocity: 100, radius: 32767 } })).ok()).toBe(true);
    await waitUntilDriving(page);
    await page.getByRole("button", { name: "Stop" }).click();
    await waitUntilStopped(page);
    await expect(page.getByRole("region", { name: "Drive" })).not.toContainText("Locked");
  } finally {
    await program.kill();
  }
});

test("a robot without leases is driven without one, and the page says so", async ({ page, lab }) => {
  const { program, url } = await startGateway("create", lab.createUrl, webRoot);
  try {
    await openRobot(page, { url });
    await page.keyboard.down("ArrowUp");
    await waitUntilDriving(page);
    await page.keyboard.up("ArrowUp");
    await waitUntilStopped(page);
    await expect(page.getByText("Nobody gives leases of it")).toBeVisible();
  } finally {
    await program.kill();
  }
});

test("a member that only its holder may use offers control where it was refused", async ({ page, lab }) => {
  const leases = { members: [{ member: "Create.Drive", lease: "required" }] };
  const devices = [{ name: "create", url: lab.createUrl, mode: "shared", leases }];
  const { program, url } = await startGateway("create", lab.createUrl, webRoot, { devices });
  try {
    await page.goto(`${url}#/devices/create/Create?view=members`);
    const drive = page.locator('[data-member="Drive"]');
    const call = drive.getByRole("button", { name: "Call Drive" });
    await drive.getByLabel("velocity").fill("0");
    await drive.getByLabel("radius").fill("0");
    await expect(drive.locator("[data-control]")).toHaveCount(0);
    await call.click();
    await expect(drive.getByRole("alert")).toContainText("this needs the lease of");
    await drive.getByRole("button", { name: "Take control" }).click();
    await expect(drive.locator("[data-control]")).toHaveAttribute("data-control", "held");
    await call.click();
    await expect(drive.locator("output").first()).toContainText("done");
    await drive.getByRole("button", { name: "Give back" }).click();
    await expect(drive.locator("[data-control]")).toHaveAttribute("data-control", "idle");

    await page.goto(`${url}#/devices/create/Create?view=board`);
    await addPanel(page, "form");
    const form = page.locator('[data-panel="form"]').last();
    await form.getByLabel("Member").selectOption("Drive");
    await form.getByRole("button", { name: "Call Drive" }).click();
    await expect(form.getByRole("alert")).toContainText("this needs the lease of");
    await form.getByRole("button", { name: "Take control" }).click();
    await form.getByRole("button", { name: "Call Drive" }).click();
    await expect(form.locator("output")).toContainText("done");
  } finally {
    await program.kill();
  }
});
