// Names that JavaScript calls by itself, and texts and documentation full of HTML: no panel breaks, nothing runs.
import { expect, test } from "../lab_test";
import { addPanel } from "../board";
import { PANEL_KINDS } from "../../../web/src/board/board";
import { startPeer } from "../peers";
import type { Peer } from "../peers";

let hostile: Peer;

test.beforeAll(async () => {
  hostile = await startPeer("test/e2e/peers/hostile.py", "hostile");
});
test.afterAll(async () => hostile.stop());

test("every panel shows a hostile service, and runs nothing of it", async ({ page }) => {
  await page.goto(`${hostile.url}#/devices/peer/hostile?view=board`);
  const of = (kind: string) => page.locator(`[data-panel="${kind}"]`).first();
  const html = `<img src=x onerror="document.title='broken in'">`;
  await expect(of("plot").locator(".freshness")).toContainText("a second");
  await expect(of("table").locator('[data-value="toString"]')).toContainText(html);
  await expect(of("table").locator('[data-value="hasOwnProperty"]')).toHaveText("prototype");
  await expect(of("log")).toContainText("<img src=x onerror=");
  await of("form").getByLabel("Member").selectOption("toString");
  await of("form").getByRole("button", { name: "Call toString" }).click();
  await expect(of("form").locator("output")).toContainText("ms");
  await of("form").getByText("Copy as code").click();
  await of("form").getByRole("button", { name: "JavaScript" }).click();
  await expect(of("form").locator("pre")).toContainText('member("toString")');
  await of("memory").getByRole("button", { name: "Read", exact: true }).click();
  await expect(of("memory").locator("[data-memory]")).toContainText("3c 69 6d 67");
  await of("generator").getByRole("button", { name: "Run" }).click();
  await expect(of("generator").getByRole("list").getByText(html).first()).toBeVisible();
  await expect(of("generator").getByRole("status")).toHaveText("ended");
  for (const kind of ["image", "pipe", "robot", "trajectory", "locks", "streams"]) {
    await addPanel(page, kind);
    await expect(of(kind).locator(".panel-body")).not.toBeEmpty();
  }
  await addPanel(page, "scene");
  await of("scene").getByLabel("Member").selectOption("constructor");
  await expect(of("scene").locator("canvas")).toHaveAccessibleName("constructor in space");
  await expect(of("scene").locator("[data-stale]")).toHaveText(/a second|no regular values/);
  await of("scene").getByText("0 frames").click();
  await addPanel(page, "teleop");
  await of("teleop").getByLabel("Member").selectOption("toString");
  await expect(of("teleop").locator(".panel-body")).toContainText("toString");
  await of("teleop").getByLabel("Member").selectOption("constructor");
  await expect(of("teleop").locator(".panel-body")).toContainText("constructor");
  await addPanel(page, "notes");
  await of("notes").getByRole("textbox", { name: "Notes", exact: true }).fill(html);
  await of("notes").getByLabel("Name of Notes").fill(html);
  await expect(page.getByRole("group", { name: html, exact: true })).toBeVisible();
  for (const kind of PANEL_KINDS) await expect(of(kind)).toBeVisible();
  await page.getByRole("button", { name: "Done" }).click();
  await expect(page.locator('[data-kept="true"]')).toBeVisible();
  await page.reload();
  await expect(page.getByRole("heading", { name: html })).toBeVisible();
  await expect(of("notes").getByRole("textbox")).toHaveValue(html);
  await of("locks").getByRole("button", { name: "Lock for this page" }).click();
  await expect(of("locks")).toContainText(/Locked by this page since|RobotRaconteur/);
  await expect(page.locator("main img")).toHaveCount(0);
  await expect(page).toHaveTitle("peer · rrgate");
  await page.goto(`${hostile.url}#/devices/peer/hostile?view=members`);
  await expect(page.locator('[data-member="then"]')).toContainText("<img src=x");
  await expect(page).toHaveTitle("peer · rrgate");
});
