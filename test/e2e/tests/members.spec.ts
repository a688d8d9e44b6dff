// The page of any service: properties, functions, wires, events and objects, built from the definition alone.
import { expect, test } from "../lab_test";

test("reads properties, calls functions and follows wires of the robot", async ({ page, lab }) => {
  await page.goto(`${lab.url}#/devices/create/Create?view=members`);
  const member = (name: string) => page.locator(`[data-member="${name}"]`);
  await expect(member("DistanceTraveled").locator("output")).toHaveText(/^-?\d+$/);
  await expect(member("state").locator("output")).toContainText("heading:");
  await expect(member("state")).toContainText("values a second");
  await expect(member("Bump")).toContainText("Listening");

  await member("Drive").getByLabel("velocity").fill("40000");
  await member("Drive").getByLabel("radius").fill("1");
  await member("Drive").getByRole("button", { name: "Call Drive" }).click();
  await expect(member("Drive").getByRole("alert")).toHaveText(
    "velocity: 40000 is out of range; expected int16, -32768 to 32767",
  );
  await member("Drive").getByLabel("velocity").fill("0");
  await member("Drive").getByRole("button", { name: "Call Drive" }).click();
  await expect(member("Drive").locator("output")).toContainText("done");
  await expect(member("Drive").getByRole("alert")).toBeHidden();
});

test("opens an object behind a reference, and shows the service's own error for a wrong one", async ({ page, lab }) => {
  await page.goto(`${lab.url}#/devices/webcams/Webcam?view=members`);
  await page.getByLabel("Index of Webcams").fill("0");
  await page.getByRole("button", { name: "Open Webcams" }).click();
  await expect(page.getByText("experimental.createwebcam2.Webcam", { exact: true })).toBeVisible();
  await expect(page.locator('[data-member="Name"] output')).not.toHaveText("not read");
  await page.getByRole("button", { name: "Call CaptureFrame", exact: true }).click();
  await expect(page.locator('[data-member="CaptureFrame"] output')).toContainText("width: 320");

  await page.goto(`${lab.url}#/devices/webcams/Webcam/Webcams%5B99%5D`);
  await expect(page.locator("main").getByRole("alert")).toContainText("RobotRaconteur.");
});

test("reads a memory", async ({ page, lab }) => {
  await page.goto(`${lab.url}#/devices/webcams/Webcam/Webcams%5B0%5D`);
  const buffer = page.locator('[data-member="buffer"]');
  await page.getByRole("button", { name: "Call CaptureFrameToBuffer" }).click();
  await expect(page.locator('[data-member="CaptureFrameToBuffer"] output')).toContainText("width: 320");
  await page.getByRole("button", { name: "Measure buffer" }).click();
  await expect(buffer).toContainText(`${320 * 240 * 3} items`);
  await buffer.getByLabel("Items of buffer").fill("[4]");
  await page.getByRole("button", { name: "Read buffer" }).click();
  await expect(buffer.locator("output")).toHaveText(/^\[?(\d+, ){3}\d+\]?$/);
  await buffer.getByLabel("Position in buffer").fill("[1000000]");
  await page.getByRole("button", { name: "Read buffer" }).click();
  await expect(buffer.getByRole("alert")).toContainText("OutOfRange");
});

test("follows a pipe, and answers a callback", async ({ page, lab }) => {
  await page.goto(`${lab.url}#/devices/webcams/Webcam/Webcams%5B0%5D`);
  const member = (name: string) => page.locator(`[data-member="${name}"]`);
  await page.getByRole("button", { name: "Call StartStreaming" }).click();
  await page.getByRole("button", { name: "Follow FrameStream" }).click();
  await expect(member("FrameStream").locator("li").nth(3)).toContainText("width: 320");
  await page.getByRole("button", { name: "Stop FrameStream" }).click();
  await expect(page.getByRole("button", { name: "Follow FrameStream" })).toBeVisible();

  await page.goto(`${lab.url}#/devices/create/Create?view=members`);
  await member("play_callback").getByLabel("Answer of play_callback").fill("[60, 16, 62, 8]");
  await page.getByRole("button", { name: "Answer play_callback", exact: true }).click();
  await page.getByRole("button", { name: "Call press_play", exact: true }).click();
  await expect(member("play_callback").locator("li").first()).toContainText("DistanceTraveled:");
  await expect(async () => {
    await page.getByRole("button", { name: "Read song" }).click();
    await expect(member("song").locator("output")).toContainText("60, 16, 62, 8", { timeout: 500 });
  }).toPass();
});

test("a service that the device does not have is said, not shown as loading for ever", async ({ page, lab }) => {
  await page.goto(`${lab.url}#/devices/create/Nothing`);
  await expect(page.locator('[data-link="lost"]')).toContainText("No connection to create since");
  await expect(page.locator(".bone")).toHaveCount(0);
});

test("a device that the gateway does not have is said to be missing, and not asked for again and again", async ({
  page,
  lab,
}) => {
  await page.goto(`${lab.url}#/devices/nowhere/Create`);
  await expect(page.locator("main")).toContainText("The gateway has no device of this name.");
  await expect(page.locator("[data-link]")).toHaveCount(0);
  await expect(page.locator(".bone")).toHaveCount(0);
  await page.getByRole("main").getByRole("link", { name: "All devices" }).click();
  await expect(page.getByRole("heading", { name: "Devices" })).toBeVisible();
});

test("the fields of a memory say what they are, and its value stands below them", async ({ page, lab }) => {
  await page.goto(`${lab.url}#/devices/webcams/Webcam/Webcams%5B0%5D`);
  const buffer = page.locator('[data-member="buffer"]');
  await page.getByRole("button", { name: "Call CaptureFrameToBuffer" }).click();
  await page.getByRole("button", { name: "Measure buffer" }).click();
  await page.getByRole("button", { name: "Read buffer" }).click();
  const value = await buffer.locator("output").boundingBox();
  for (const label of ["Position in buffer", "Items of buffer"]) {
    const field = await buffer.getByLabel(label).boundingBox();
    const words = await buffer.getByText(label).boundingBox();
    expect(words?.width, label).toBeGreaterThan(50);
    expect(value?.y, label).toBeGreaterThanOrEqual((field?.y ?? Infinity) + (field?.height ?? 0));
  }
});

test("values of a device that is lost are marked old, and one that freezes is said not to answer", async ({
  page,
  lab,
}) => {
  await page.goto(`${lab.url}#/devices/create/Create?view=members`);
  const property = page.locator('[data-member="DistanceTraveled"]');
  await expect(property.locator("output")).toHaveText(/^-?\d+$/);
  await expect(page.locator('[data-member="state"]')).toContainText("values a second");
  lab.create.signal("SIGSTOP");
  try {
    await expect(page.locator("main").getByRole("alert").first()).toContainText("The device has not answered for");
    await expect(page.locator('[data-member="state"] .wire')).toHaveClass(/is-stale/);
  } finally {
    lab.create.signal("SIGCONT");
  }
  await expect(page.getByText("The device has not answered for")).toBeHidden();
  await expect(property.locator(".is-stale")).toHaveCount(0);

  await lab.create.kill();
  await expect(property.locator(".is-stale")).toContainText(/Stale: \d+ s old/);
  lab.create.start();
  await expect(property.locator(".is-stale")).toHaveCount(0);
});
