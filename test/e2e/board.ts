// What tests of boards do on the page.
import type { Page } from "@playwright/test";

export async function addPanel(page: Page, kind: string): Promise<void> {
  await page.getByLabel("Kind of panel").selectOption(kind);
  await page.getByRole("button", { name: "Add panel" }).click();
}
