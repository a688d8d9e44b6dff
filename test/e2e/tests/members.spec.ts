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
  await expect(member("Drive").getByRole("alert")).toHaveText("velocity: 40000 is out of range; expected int16, -32768 to 32767");
  await member("Drive").getByLabel("velocity").fill("0");
  await member("Drive").getByRole("button", { name: "Call Drive" }).click();
  await expect(member("Drive").locator("output")).toContainText("done");
  await expect(member("Drive").getByRole("alert")).toBeHidden();
});

test("opens an object behind a reference, and shows the service's own error for a wrong one", async ({ page, lab }) => {
  await page.goto(`${lab.url}#/devices/webcams/Webcam`);
  await page.getByLabel("Index of Webcams").fill("0");
  await page.getByRole("button", { name: "Open Webcams" }).click();
  await expect(page.getByText("experimental.createwebcam2.Webcam", { exact: true })).toBeVisible();
  await expect(page.locator('[data-member="Name"] output')).not.toHaveText("not read");
  await page.getByRole("button", { name: "Call CaptureFrame", exact: true }).click();
  await expect(page.locator('[data-member="CaptureFrame"] output')).toContainText("width: 320");

  await page.goto(`${lab.url}#/devices/webcams/Webcam/Webcams%5B99%5D`);
  await expect(page.locator("main").getByRole("alert")).toContainText("RobotRaconteur.");
});

test("a service that the device does not have is said, not shown as loading for ever", async ({ page, lab }) => {
  await page.goto(`${lab.url}#/devices/create/Nothing`);
  await expect(page.locator('[data-link="lost"]')).toContainText("No connection to create since");
});
