// The page of recordings: begin one, see it grow, stop it, get its file, delete it; play one; and a gateway that records
// nothing.
import { copyFileSync, mkdtempSync, readFileSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";
import { expect, test } from "../lab_test";
import { repositoryRoot, startGateway, webRoot } from "../processes";

test("a recording is begun, followed, stopped, downloaded and deleted", async ({ page, lab }) => {
  const folder = mkdtempSync(path.join(tmpdir(), "rrgate-recordings-"));
  const gateway = await startGateway("create", lab.createUrl, webRoot, { recordings: { folder } });
  try {
    await page.goto(gateway.url);
    await page.getByRole("link", { name: "Recordings" }).click();
    await expect(page.getByText("There are no recordings yet.")).toBeVisible();
    await page.getByLabel("Service to record").selectOption("create/Create");
    await page.getByRole("button", { name: "Record", exact: true }).click();
    const row = page.locator('[data-recording^="create.Create."]');
    await expect(row).toHaveAttribute("data-state", "recording");
    await expect(row).toContainText(/[1-9][\d.]* kB/, { timeout: 15_000 });
    await row.getByRole("button", { name: "Stop recording" }).click();
    await expect(row).toHaveAttribute("data-state", "ended");
    const begun = page.waitForEvent("download");
    await row.getByRole("link", { name: "Download" }).click();
    const file = await (await begun).path();
    expect(readFileSync(file).subarray(1, 5).toString()).toBe("MCAP");
    await row.getByRole("button", { name: "Delete", exact: true }).click();
    await row.getByRole("button", { name: "Keep it" }).click();
    await row.getByRole("button", { name: "Delete", exact: true }).click();
    await row.getByRole("button", { name: "Delete it for good" }).click();
    await expect(row).toHaveCount(0);
  } finally {
    await gateway.program.kill("SIGTERM");
  }
});

test("a recording is played: its panels show its values, the time line goes to others, and it says what it is", async ({
  page,
  lab,
}) => {
  const folder = mkdtempSync(path.join(tmpdir(), "rrgate-recordings-"));
  const name = "create.Create.20261125T083000123Z";
  const kept = path.join(repositoryRoot, "test/golden/recordings/create.mcap");
  copyFileSync(kept, path.join(folder, `${name}.mcap`));
  const gateway = await startGateway("create", lab.createUrl, webRoot, { recordings: { folder } });
  try {
    await page.goto(`${gateway.url}#/recordings`);
    const row = page.locator(`[data-recording="${name}"]`);
    await row.getByRole("button", { name: "Play", exact: true }).click();
    await row.getByRole("link", { name: "Show the recording" }).click();
    const bar = page.getByRole("region", { name: "Replay" });
    await expect(bar).toContainText("/ 0:05.0");
    const mark = page.getByText("recording", { exact: true });
    await expect(mark).toBeVisible();
    await expect(page.getByRole("heading", { level: 1 })).toHaveText(`replay~${name}`);
    await expect(page.getByRole("button", { name: "Forward" })).toHaveCount(0); // nothing drives a recording
    await expect(page.locator(".stop-button, .camera")).toHaveCount(0);
    const x = page.locator('[data-pose="x"]');
    const recorded = async (): Promise<number> =>
      ((await (await fetch(`${gateway.url}api/v1/devices/replay~${name}/Create/state`)).json()) as { x: number }).x;
    await expect(bar).toContainText("0:05.0 / 0:05.0", { timeout: 20_000 }); // it has been played to its end
    const atEnd = await recorded();
    expect(atEnd).toBeGreaterThan(0.5);
    await expect(x).toHaveText(`${atEnd.toFixed(3)} m`);
    await expect(page.getByText("NotImplementedError")).toHaveCount(0);
    await bar.getByLabel("Time of the recording").fill("2");
    await expect(bar).toContainText("0:02.0 / 0:05.0");
    const then = await recorded();
    expect(then).toBeLessThan(atEnd - 0.1);
    await expect(x).toHaveText(`${then.toFixed(3)} m`);

    await page.goto(`${gateway.url}#/`);
    const card = page.locator(`[data-device="replay~${name}"]`);
    await expect(card.getByText("recording", { exact: true })).toBeVisible();
    await expect(page.locator('[data-device="create"]').getByText("recording", { exact: true })).toHaveCount(0);
    await page.goto(`${gateway.url}#/recordings`);
    await row.getByRole("button", { name: "Stop playing" }).click();
    await expect(row.getByRole("button", { name: "Play", exact: true })).toBeVisible();
    await page.goto(`${gateway.url}#/devices/replay~${name}/Create`);
    await expect(page.getByText(/The gateway has no device/).first()).toBeVisible();
  } finally {
    await gateway.program.kill("SIGTERM");
  }
});

test("a gateway that records nothing says so", async ({ page, lab }) => {
  await page.goto(`${lab.url}#/recordings`);
  await expect(page.getByText("This gateway records nothing")).toBeVisible();
  await expect(page.getByRole("button", { name: "Record", exact: true })).toHaveCount(0);
});
