// The first page: devices, their states, and what it says when the gateway is away.
import { expect, test } from "../lab_test";
import { Program, rrgate } from "../processes";

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

test("of 5000 devices one is found, states and types are groups, and the list scrolls without long tasks", async ({
  page,
  lab,
}) => {
  const devices = [...Array(5000)].map((_, i) => ({
    name: `device-${i}`,
    url: `rr+tcp://10.1.${i >> 8}.${i & 255}:52222/`,
    state: i % 10 === 0 ? "offline" : "online",
    services: [{ name: "main", type: i % 2 ? "com.example.Camera" : "com.example.Robot" }],
  }));
  await page.route("**/api/v1/devices", (route) => route.fulfill({ json: { devices } }));
  await page.goto(lab.url);
  const line = (index: number) => page.locator(`[data-device="device-${index}"]`);
  await expect(line(0)).toBeVisible();
  const slowest = await page.evaluate(async () => {
    const gaps: number[] = [];
    const list = document.querySelector(".device-list")!;
    for (let frame = 0, last = performance.now(); frame < 60; frame++) {
      window.scrollBy(0, 3000);
      await new Promise(requestAnimationFrame);
      gaps.push(performance.now() - last);
      last = performance.now();
      if (list.childElementCount > 120) throw new Error(`${list.childElementCount} items at once`);
    }
    return gaps.sort((a, b) => a - b)[Math.floor(gaps.length / 2)];
  });
  expect(slowest).toBeLessThan(50);
  await page.keyboard.press("End");
  await expect(line(4999)).toBeInViewport();

  await page.getByLabel("Search devices").fill("10.1.3.7: camera");
  await expect(line(775)).toBeVisible();
  await expect(page.locator("[data-device]")).toHaveCount(1);
  await line(775).getByRole("button", { name: "More of device-775" }).click();
  await expect(line(775)).toContainText("Address");
  await page.getByLabel("Search devices").fill("");
  await page.getByLabel("State", { exact: true }).selectOption("offline");
  await page.getByLabel("Groups").selectOption("type");
  await expect(page.getByRole("heading", { name: "com.example.Robot 500" })).toBeVisible();
  await page.reload();
  await expect(page.getByRole("heading", { name: "com.example.Robot 500" })).toBeVisible();
  await page.getByLabel("Search devices").fill("nothing like it");
  await page.getByRole("button", { name: "Show all" }).click();
  await expect(page.getByRole("status").filter({ hasText: "5000 of 5000" })).toBeVisible();
});

test("of the fleet of the demo few devices are drawn at once, and each has its board", async ({ page }) => {
  const demo = new Program(rrgate, ["demo", "fleet", "--count", "1000", "--port", "0", "--no-browser"]);
  demo.start();
  try {
    const [, url = ""] = await demo.waitForOutput(/rrgate demo: (http:\/\/127\S+)/);
    await page.goto(url);
    await expect(page.getByText("1000 of 1000 devices online")).toBeVisible();
    const last = page.locator('[data-device="sensor-1000"]');
    await expect(page.locator('[data-device="sensor-1"]')).toBeVisible();
    expect(await page.locator("[data-device]").count()).toBeLessThan(120);
    await page.keyboard.press("End");
    await expect(last).toBeInViewport();
    expect(await page.locator("[data-device]").count()).toBeLessThan(120);
    await last.getByRole("link", { name: "Sensor" }).click();
    await expect(page.getByRole("img", { name: /^Plot of temperature/ })).toBeVisible();
    await expect(page.locator('[data-panel="form"]')).toContainText("offset");
  } finally {
    await demo.kill("SIGTERM");
  }
});
