// What tests of boards do on the page.
import type { Page } from "@playwright/test";

/** Shows what a board is made of, and the tools that change it. */
export async function arrange(page: Page): Promise<void> {
  const button = page.getByRole("button", { name: /^(Arrange|Done)$/ });
  if ((await button.innerText()) === "Arrange") await button.click();
}

export async function addPanel(page: Page, kind: string): Promise<void> {
  await arrange(page);
  await page.getByLabel("Kind of panel").selectOption(kind);
  await page.getByRole("button", { name: "Add panel" }).click();
}
