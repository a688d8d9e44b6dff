// The documentation that the gateway serves: nothing of it is refused by the gateway's policy, or comes from elsewhere.
import type { Page } from "@playwright/test";
import { expect, test } from "../lab_test";
import { startGateway, webRoot } from "../processes";

test("pages and their search work without any other host", async ({ page, lab }) => {
  await lookAround(page, lab.url);
});

test("pages and their search work below a path", async ({ page, lab }) => {
  const { program, url } = await startGateway("create", lab.createUrl, webRoot, { base_path: "/robots/lab" });
  try {
    await lookAround(page, `${url}robots/lab/`);
    expect(new URL(page.url()).pathname).toBe("/robots/lab/docs/access.html");
  } finally {
    await program.kill("SIGTERM");
  }
});

async function lookAround(page: Page, base: string): Promise<void> {
  const elsewhere: string[] = [];
  const complaints: string[] = [];
  page.on("request", (request) => {
    if (!request.url().startsWith(base)) elsewhere.push(request.url());
  });
  page.on("console", (message) => {
    if (message.type() === "error") complaints.push(message.text());
  });
  await page.goto(`${base}docs/`);
  await expect(page.getByRole("heading", { name: "What rrgate is" })).toBeVisible();
  const words = page.getByPlaceholder("Search");
  await expect(async () => {
    await page.keyboard.press("Control+k"); // nobody hears it before the page's script runs
    await expect(words).toBeVisible({ timeout: 500 });
  }).toPass();
  await words.fill("allowed_hosts");
  await page.locator(".VPLocalSearchBox .result").filter({ hasText: "Host names" }).first().click();
  await expect(page).toHaveURL(/access\.html#host-names$/);
  await expect(page.getByRole("heading", { name: "Host names" })).toBeVisible();
  expect(elsewhere).toEqual([]);
  expect(complaints).toEqual([]);
}
