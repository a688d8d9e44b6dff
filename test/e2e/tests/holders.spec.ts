// Who has leases and locks of an object, in the Lock panel of a page that has none.
import { expect, test } from "@playwright/test";
import type { Locator } from "@playwright/test";
import { addPanel } from "../board";
import { GuardedLab, password } from "../guarded_lab";
import { startTestService, webRoot } from "../processes";

test("a lease of somebody else is shown while it lasts", async ({ page }) => {
  const leases = { safe: [{ property: "interop.p_double", value: 0 }], takeover: ["*"] };
  const lab = await startTestService(webRoot, (url) => ({ devices: [{ name: "big", url, mode: "shared", leases }] }));
  try {
    await page.goto(`${lab.url}#/devices/big/interop?view=board`);
    await addPanel(page, "locks");
    const panel = page.locator('[data-panel="locks"]');
    await expect(panel).toContainText("The gateway knows of no lease or lock of it");
    const object = `${lab.url}api/v1/devices/big/interop`;
    const taken = await page.request.post(`${object}?lease=acquire&deadman=30000`);
    const { lease } = (await taken.json()) as { lease: string };
    await expect(panel.getByRole("list", { name: "Leases and locks" })).toHaveText(
      /^interop: somebody who is not signed in has the lease, (30|2\d) s left, unless it is renewed$/,
    );
    await page.request.post(`${object}?lease=release`, { headers: { ["Rrgate-Lease"]: lease } });
    await expect(panel).toContainText("The gateway knows of no lease or lock of it");
  } finally {
    await lab.stop();
  }
});

test("who would command sees who has the lease, and for how long", async ({ page }) => {
  const lab = await GuardedLab.start(webRoot, { device: { mode: "shared", leases: { takeover: ["*"] } } });
  try {
    const headers = { Authorization: `Bearer ${lab.token}` };
    const robot = `${lab.url}api/v1/devices/create/Create`;
    const taken = await fetch(`${robot}?lease=acquire&deadman=60000`, { method: "POST", headers });
    const { lease } = (await taken.json()) as { lease: string };
    await page.goto(`${lab.url}#/devices/create/Create?view=board`);
    await page.getByLabel("Name").fill("root");
    await page.getByLabel("Password or token").fill(password);
    await page.keyboard.press("Enter");
    const left = async (place: Locator) =>
      Number(/(\d+) s left, unless it is renewed$/.exec(await place.innerText())?.[1]);
    const list = page.getByRole("list", { name: "Leases and locks" });
    await addPanel(page, "locks");
    await expect(list).toHaveText(/^Create: page has the lease, [1-5]\d s left/);
    const before = await left(list);
    await expect.poll(() => left(list)).toBeLessThan(before);

    await page.getByRole("link", { name: "Drive" }).click();
    const holder = page.locator("[data-holder]");
    await expect(holder).toHaveText(/page is in control, [1-5]\d s left, unless it is renewed$/);
    await fetch(`${robot}?lease=release`, { method: "POST", headers: { ...headers, ["Rrgate-Lease"]: lease } });
    await expect(holder).toHaveCount(0);
  } finally {
    await lab.stop();
  }
});
