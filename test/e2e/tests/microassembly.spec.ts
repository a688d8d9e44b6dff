// The board of `rrgate demo microassembly`: it moves a probe, and shows what the microscopes see.
import { expect, test } from "@playwright/test";
import { Program, rrgate } from "../processes";

test("one board moves the probes and shows the microscopes", async ({ page }) => {
  const demo = new Program(rrgate, ["demo", "microassembly", "--port", "0", "--no-browser"]);
  demo.start();
  try {
    const [, url] = await demo.waitForOutput(/rrgate demo: (http:\/\/127\S+)/);
    await page.goto(`${url}#/devices/cell/Cell`);
    const pictures = page.locator('[data-panel="image"] canvas');
    await expect(pictures).toHaveCount(4);
    const look = (): Promise<string> =>
      pictures.first().evaluate((canvas) => (canvas as HTMLCanvasElement).toDataURL());
    const empty = await page.evaluate(() => document.createElement("canvas").toDataURL());
    await expect.poll(look, { timeout: 20_000 }).not.toBe(empty);
    // A probe that is out of sight comes into it.
    let before = "";
    await expect.poll(async () => before === (before = await look()), { timeout: 20_000 }).toBe(true);
    const base = `${url}api/v1/devices/cell/Cell`;
    const moved = await fetch(`${base}/move`, {
      method: "POST",
      headers: { "Content-Type": "application/json" },
      body: JSON.stringify({ probe: 2, by: [0.5, 0, 0, 0.5] }),
    });
    expect(moved.ok).toBe(true);
    await expect.poll(look, { timeout: 20_000 }).not.toBe(before);
  } finally {
    await demo.kill("SIGTERM");
  }
});
