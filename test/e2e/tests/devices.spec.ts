// The first page: devices, their states, and what it says when the gateway is away.
import { expect, test } from "../lab_test";

test("lists the devices with their state and services", async ({ page, lab }) => {
  await page.goto(lab.url);
  await expect(page).toHaveTitle("Devices · rrgate");
  for (const [device, service] of [
    ["create", "Create"],
    ["webcams", "Webcam"],
  ] as const) {
    const row = page.locator(`[data-device="${device}"]`);
    await expect(row.locator('[data-state="online"]')).toBeVisible();
    await expect(row.getByRole("link", { name: service })).toBeVisible();
  }
  await page.getByRole("link", { name: /^Create/ }).click();
  await expect(page.locator('[data-link="online"]')).toBeVisible();
});

test("says which device is away, and that it came back", async ({ page, lab }) => {
  await page.goto(lab.url);
  const row = page.locator('[data-device="webcams"]');
  await expect(row.locator('[data-state="online"]')).toBeVisible();
  await lab.webcams.kill();
  await expect(row.locator('[data-state="online"]')).toBeHidden({ timeout: 20_000 });
  await expect(row).toContainText("The gateway keeps trying.");
  lab.webcams.start();
  await expect(row.locator('[data-state="online"]')).toBeVisible({ timeout: 20_000 });
});

test("says plainly when the gateway itself is away, and recovers", async ({ page, lab }) => {
  await page.goto(lab.url);
  await expect(page.locator('[data-gateway="known"]')).toBeVisible();
  await lab.gateway.kill();
  await expect(page.locator('[data-gateway="away"]')).toContainText("The gateway does not answer since");
  await expect(page.locator('[data-device="create"]')).toContainText("was online");
  lab.gateway.start();
  await expect(page.locator('[data-gateway="known"]')).toBeVisible();
  await lab.waitUntilOnline();
  await expect(page.locator('[data-device="create"]').locator('[data-state="online"]')).toHaveText("online");
});

test("an address that leads nowhere says so", async ({ page, lab }) => {
  await page.goto(`${lab.url}#/nowhere`);
  await expect(page.getByRole("heading", { name: "No such page" })).toBeVisible();
});

test("the chosen colours stay after a reload", async ({ page, lab }) => {
  await page.goto(lab.url);
  await page.getByRole("button", { name: /^Colours: system/ }).click();
  await page.getByRole("button", { name: /^Colours: light/ }).click();
  await expect(page.locator("html")).toHaveAttribute("data-theme", "dark");
  await page.reload();
  await expect(page.locator("html")).toHaveAttribute("data-theme", "dark");
});
