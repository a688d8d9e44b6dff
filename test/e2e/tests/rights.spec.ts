// What users may do and have done, as the page tells it; and whose page it is when another user signs in.
import { expect, test } from "@playwright/test";
import type { Page } from "@playwright/test";
import { GuardedLab, password } from "../guarded_lab";
import { webRoot } from "../processes";

let lab: GuardedLab;

test.beforeAll(async () => {
  lab = await GuardedLab.start(webRoot, { device: { mode: "shared" }, more: { audit: { file: "audit.jsonl" } } });
});

test.afterAll(() => lab?.stop());

const rights = (page: Page) => page.locator("details.rights");
const you = (page: Page) => page.getByRole("group", { name: "You" });
const press = (page: Page, name: string) => page.getByRole("button", { name, exact: true }).click();

async function signIn(page: Page, name: string, secret = password): Promise<void> {
  await page.getByLabel("Name").fill(name);
  await page.getByLabel("Password or token").fill(secret);
  await page.keyboard.press("Enter");
  await expect(you(page)).toContainText(name === "" ? "page" : name);
}

test("who is signed in sees what he may do, to all of a device or to the gateway", async ({ page }) => {
  await page.setViewportSize({ width: 412, height: 839 });
  await page.goto(lab.url);
  await signIn(page, "vera");
  await rights(page).locator("summary").click();
  await expect(rights(page).locator('[data-rights="create"]')).toHaveText("createEverything: read");
  await expect(rights(page)).toContainText("Known by: password.");
  await expect(rights(page).locator("[data-rights-gateway]")).toHaveCount(0);
  const box = (await page.locator(".rights-sheet").boundingBox())!;
  expect(box.x).toBeGreaterThanOrEqual(0);
  expect(box.x + box.width).toBeLessThanOrEqual(412);
  expect(await page.evaluate(() => document.documentElement.scrollWidth)).toBeLessThanOrEqual(412);
  await page.keyboard.press("Escape");
  await expect(rights(page).locator(".rights-sheet")).toBeHidden();
  await expect(page.getByText("What users did")).toHaveCount(0);
  await press(page, "Sign out");

  await signIn(page, "root");
  await rights(page).locator("summary").click();
  await expect(rights(page).locator('[data-rights="create"]')).toContainText(
    "Everything: read, write, call, subscribe, lock",
  );
  await expect(rights(page).locator("[data-rights-gateway]")).toContainText("admin");
});

test("an admin sees what a user did last, and what was refused", async ({ page }) => {
  const call = (body: string, headers: Record<string, string>) =>
    fetch(`${lab.url}api/v1/devices/create/Create/Drive`, {
      method: "POST",
      headers: { ["Content-Type"]: "application/json", ...headers },
      body,
    });
  const stop = JSON.stringify({ velocity: 0, radius: 32767 });
  expect((await call(stop, { Authorization: `Bearer ${lab.token}` })).ok).toBe(true);
  expect((await call(stop, { Authorization: `Basic ${btoa(`vera:${password}`)}` })).status).toBe(403);

  await page.goto(lab.url);
  await signIn(page, "root");
  const part = page.locator("details", { hasText: "What users did" });
  await part.getByText("What users did").click();
  const rows = part.locator("[data-deed]");
  await expect(rows.first()).toContainText("signed_in"); // oneself, just now
  await expect(rows.filter({ hasText: "create · Create.Drive" })).toHaveCount(2);
  await part.getByRole("textbox", { name: "User" }).fill("vera");
  await press(page, "Show");
  await expect(rows.first()).toContainText("refused");
  await expect(rows.first()).toContainText("create · Create.Drive");
  for (const row of await rows.all()) await expect(row).toContainText("vera");
  await part.getByRole("textbox", { name: "User" }).fill("p?ge");
  await part.getByRole("textbox", { name: "Device" }).fill("create");
  await press(page, "Show");
  await expect(rows).toHaveCount(1);
  await expect(rows).toContainText("call");
  await expect(rows).toContainText("ok");
  await part.getByRole("textbox", { name: "Device" }).fill("nothing");
  await press(page, "Show");
  await expect(rows).toHaveCount(0);
  await expect(part.getByRole("status")).toHaveText("Nothing is recorded of that.");
  await page.setViewportSize({ width: 360, height: 700 });
  expect(await page.evaluate(() => document.documentElement.scrollWidth)).toBeLessThanOrEqual(360);
});

test("when another user signs in, in another tab, the page begins anew with that user's connection and rights", async ({
  page,
  context,
}) => {
  const open = new Set<string>();
  const seen: string[] = [];
  page.on("websocket", (socket) => {
    seen.push(socket.url());
    open.add(socket.url());
    socket.on("close", () => open.delete(socket.url()));
  });
  await page.goto(`${lab.url}#/devices/create/Create?view=members`);
  await signIn(page, "root");
  const drive = page.locator('[data-member="Drive"]');
  const call = async (): Promise<void> => {
    await drive.getByLabel("velocity").fill("0");
    await drive.getByLabel("radius").fill("1");
    await drive.getByRole("button", { name: "Call Drive" }).click();
  };
  await call();
  await expect(drive.locator("output")).toContainText("done");
  const ofRoot = [...seen];
  expect(ofRoot.length).toBeGreaterThan(0);

  // Without a sign-out between: what the page shows and has open would go on with the rights of the first.
  const other = await context.newPage();
  await other.goto(lab.url);
  await expect(you(other)).toContainText("root");
  const status = await other.evaluate(async (secret) => {
    const headers = { ["Content-Type"]: "application/json" };
    const body = JSON.stringify({ user: "vera", password: secret });
    return (await fetch("api/v1/session", { method: "POST", headers, body })).status;
  }, password);
  expect(status).toBe(201);

  await expect(you(page)).toContainText("vera viewer");
  await expect(drive.locator("output")).not.toContainText("done"); // another page
  await expect.poll(() => ofRoot.filter((url) => open.has(url))).toEqual([]);
  await expect(page.locator('[data-link="online"]')).toBeVisible();
  await expect(page.locator('[data-member="DistanceTraveled"] output')).toHaveText(/^-?\d+$/);
  await call();
  await expect(drive.getByRole("alert")).toContainText("'vera' (viewer) may not call 'Drive'");
  await rights(page).locator("summary").click();
  await expect(rights(page).locator('[data-rights="create"]')).toHaveText("createEverything: read");
  await expect(page.getByRole("button", { name: "Stop all agents" })).toHaveCount(0);
});
