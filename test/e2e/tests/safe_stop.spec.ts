// The stop of a device that has no member to stop it: what the gateway does when a lease ends.
import { expect, test } from "@playwright/test";
import type { Page } from "@playwright/test";
import { startTestService, webRoot } from "../processes";

let lab: Awaited<ReturnType<typeof startTestService>>;
let value: string;

test.beforeAll(async () => {
  const leases = { safe: [{ property: "interop.p_double", value: 0 }], takeover: ["*"] };
  lab = await startTestService(webRoot, (url) => ({ devices: [{ name: "big", url, mode: "shared", leases }] }));
  value = `${lab.url}api/v1/devices/big/interop/p_double`;
});

test.afterAll(() => lab?.stop());

const put = async (page: Page) => expect((await page.request.put(value, { data: 5 })).status()).toBe(204);
const read = async (page: Page) => (await page.request.get(value)).json();

for (const view of ["members", "board"]) {
  test(`Stop, and Escape, let the gateway make the device safe: ${view}`, async ({ page }) => {
    await page.goto(`${lab.url}#/devices/big/interop?view=${view}`);
    await expect(page.locator('[data-stop="ready"]')).toContainText("interop.p_double");
    for (const stop of [() => page.locator("button.stop-button").click(), () => page.keyboard.press("Escape")]) {
      await put(page);
      await stop();
      await expect.poll(() => read(page)).toBe(0);
      await expect(page.locator('[data-stop="passed"]')).toContainText("the device has answered");
    }
    await put(page); // nobody has the lease any more
  });
}

test("Stop makes a device safe whose lease nobody may take over, while nobody has it", async ({ page }) => {
  const leases = { safe: [{ property: "interop.p_double", value: 0 }] };
  const other = await startTestService(webRoot, (url) => ({
    devices: [{ name: "big", url, mode: "shared", leases }],
  }));
  try {
    const object = `${other.url}api/v1/devices/big/interop`;
    await page.goto(`${other.url}#/devices/big/interop?view=members`);
    await expect(page.locator('[data-stop="ready"]')).toBeVisible();
    expect((await page.request.put(`${object}/p_double`, { data: 5 })).status()).toBe(204);
    await page.locator("button.stop-button").click();
    await expect(page.locator('[data-stop="passed"]')).toBeVisible();
    await expect.poll(async () => (await page.request.get(`${object}/p_double`)).json()).toBe(0);
    expect((await page.request.post(`${object}?lease=acquire&deadman=60000`)).ok()).toBe(true);
    await page.locator("button.stop-button").click();
    await expect(page.locator('[data-stop="failed"]')).toContainText(/NOT STOPPED: .* has the lease of/);
  } finally {
    await other.stop();
  }
});

test("Stop says why the device may not be safe", async ({ page }) => {
  await page.goto(`${lab.url}#/devices/big/interop?view=members`);
  await expect(page.locator('[data-stop="ready"]')).toBeVisible();
  await page.route("**/interop?lease=*", (route) => route.fulfill({ status: 403, json: { detail: "not for you" } }));
  await page.locator("button.stop-button").click();
  await expect(page.locator('[data-stop="failed"]')).toHaveText("NOT STOPPED: not for you");
});
