// Panels of a board that keep what is typed in, and what was read.
import type { Page } from "@playwright/test";
import { expect, test } from "../lab_test";
import { addPanel } from "../board";

async function openBoard(page: Page, url: string, object = "create/Create"): Promise<void> {
  await page.goto(`${url}#/devices/${object}?view=board`);
  await expect(page.locator('[data-link="online"]')).toBeVisible();
}

test("what is typed into a form is still there after an outage", async ({ page, lab }) => {
  await openBoard(page, lab.url);
  const form = page.getByRole("group", { name: "Calls", exact: true });
  await form.getByLabel("Member").selectOption("Drive");
  await form.getByLabel("velocity").fill("120");
  await form.getByRole("textbox", { name: /^radius/ }).fill("300");
  await lab.create.kill();
  await expect(page.locator('[data-link="lost"]')).toBeVisible();
  lab.create.start();
  await lab.waitUntilOnline();
  await expect(page.locator('[data-link="online"]')).toBeVisible({ timeout: 30_000 });
  await expect(form.getByRole("button", { name: "Call Drive" })).toBeEnabled();
  await expect(form.getByLabel("velocity")).toHaveValue("120");
  await expect(form.getByRole("textbox", { name: /^radius/ })).toHaveValue("300");
});

test("a new position of a memory can be typed while the old items are shown", async ({ page, lab }) => {
  const capture = `${lab.url}api/v1/devices/webcams/Webcam/Webcams/0/CaptureFrameToBuffer`;
  const captured = await fetch(capture, {
    method: "POST",
    headers: { "Content-Type": "application/json" },
    body: "{}",
  });
  expect(captured.ok).toBe(true);
  await openBoard(page, lab.url, "webcams/Webcam/Webcams%5B0%5D");
  await addPanel(page, "memory");
  const memory = page.locator('[data-panel="memory"]').last();
  await expect(memory).toContainText("230400 items");
  await memory.getByLabel("Position").fill("32");
  await memory.getByRole("button", { name: "Read", exact: true }).click();
  await expect(memory.locator("[data-memory]")).toContainText(/^ +32 {2}/);
  for (const text of ["-", "0x", "0x10"]) {
    await memory.getByLabel("Position").fill(text);
    await expect(memory.locator("[data-memory]"), text).toContainText(/^ +32 {2}/);
  }
  await memory.getByRole("button", { name: "Read", exact: true }).click();
  await expect(memory.locator("[data-memory]")).toContainText(/^ +16 {2}/);
});

test("a pipe panel of an object without pipes says so", async ({ page, lab }) => {
  await openBoard(page, lab.url);
  await addPanel(page, "pipe");
  await expect(page.locator('[data-panel="pipe"]')).toContainText("This object has no pipes.", { timeout: 5_000 });
});

test("a picture from before an outage stays marked as old until the camera has sent another one", async ({
  page,
  lab,
}) => {
  await openBoard(page, lab.url, "webcams/Webcam/Webcams%5B0%5D");
  const panel = page.locator('[data-panel="image"]').first();
  const box = panel.locator(".image-box");
  await panel.getByRole("button", { name: "Start stream" }).click();
  await expect(panel.locator(".freshness")).toContainText("a second");
  await expect(box).not.toHaveClass(/is-stale/);
  await lab.webcams.kill();
  await expect(box).toHaveClass(/is-stale/);
  lab.webcams.start();
  await lab.waitUntilOnline();
  await expect(page.locator('[data-link="online"]')).toBeVisible({ timeout: 30_000 });
  const again = panel.getByRole("button", { name: "Start stream" });
  await expect(again).toBeEnabled(); // the camera streams only when it is told to again
  await expect(panel.locator(".freshness")).toHaveText(/^Stale: /);
  await expect(box).toHaveClass(/is-stale/);
  await again.click();
  await expect(box).not.toHaveClass(/is-stale/);
});
