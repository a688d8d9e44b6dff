// Baxter on Wheels, as `rrgate demo baxter` starts it: driven by the keys of the board of its base, with its arms and cameras.
import path from "node:path";
import { expect, test } from "@playwright/test";
import { Program, repositoryRoot, rrgate } from "../processes";

const python = process.env["RRGATE_PYTHON"] ?? path.join(repositoryRoot, "build/deps/venv/bin/python");
let demo: Program;
let url: string;

test.beforeAll(async () => {
  const environment = { ["PATH"]: `${path.dirname(python)}:${process.env["PATH"]}` };
  demo = new Program(rrgate, ["demo", "baxter", "--port", "0", "--no-browser"], environment);
  demo.start();
  url = (await demo.waitForOutput(/http:\/\/127\.0\.0\.1:\d+\//, 60_000))[0];
});
test.afterAll(() => demo?.kill("SIGTERM"));

test("the base drives while a key is held, its arms jog, its cameras see, and Stop stops it", async ({ page }) => {
  await page.goto(`${url}#/devices/baxter/base`);
  const value = async (name: string): Promise<number> =>
    Number.parseFloat(await page.locator(`[data-panel="table"] [data-value="${name}"]`).innerText());
  for (const camera of ["Head", "Left hand", "Right hand"]) {
    const canvas = page.getByRole("group", { name: camera, exact: true }).locator("canvas");
    await expect(canvas).toHaveJSProperty("width", 160);
  }
  const sticks = page.getByRole("application", { name: /^Sticks/ });
  await expect(sticks).toHaveAttribute("aria-disabled", "false");
  await sticks.click({ position: { x: 5, y: 5 } });
  await page.keyboard.down("ArrowUp");
  await expect.poll(() => value("x")).toBeGreaterThan(0.3);
  await page.keyboard.up("ArrowUp");
  await expect.poll(() => value("speed")).toBe(0);
  await page.keyboard.down("ArrowLeft");
  await expect.poll(() => value("heading")).toBeGreaterThan(0.2);
  await page.getByRole("button", { name: "Stop", exact: true }).click();
  await expect(page.locator('[data-stop="arrived"]')).toBeVisible();
  await page.keyboard.up("ArrowLeft");
  await expect.poll(() => value("turn")).toBe(0);

  const arm = page.getByRole("group", { name: "Left arm", exact: true });
  await arm.getByRole("button", { name: "Jog", exact: true }).click();
  const forward = arm.getByRole("button", { name: "left_w2 forward" });
  await expect(forward).toBeEnabled();
  await forward.focus();
  await page.keyboard.down("Space");
  await expect
    .poll(async () => Number.parseFloat(await arm.locator('[data-joint="6"] .joint-value').innerText()))
    .toBeGreaterThan(0.05);
  await page.keyboard.up("Space");
});
