// The page of recordings: begin one, see it grow, stop it, get its file, delete it; and a gateway that records nothing.
import { mkdtempSync, readFileSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";
import { expect, test } from "../lab_test";
import { startGateway, webRoot } from "../processes";

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

test("a gateway that records nothing says so", async ({ page, lab }) => {
  await page.goto(`${lab.url}#/recordings`);
  await expect(page.getByText("This gateway records nothing")).toBeVisible();
  await expect(page.getByRole("button", { name: "Record", exact: true })).toHaveCount(0);
});
