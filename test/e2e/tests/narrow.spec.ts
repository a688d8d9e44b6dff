// What has little room: long names, narrow panels, the head of a phone, and a visitor who has not signed in.
import { expect, test } from "@playwright/test";
import type { Locator, Page } from "@playwright/test";
import { GuardedLab, password } from "../guarded_lab";
import { webRoot } from "../processes";

const NAME = "assembly-line-north-building-7-station-12-left-manipulator-spare";
const PHONE = { width: 390, height: 844 };
const TABLET = { width: 1024, height: 768 };
const UPRIGHT = { width: 820, height: 1180 };
let lab: GuardedLab;

test.beforeAll(async () => {
  lab = await GuardedLab.start(webRoot, { device: { name: NAME } });
});

test.afterAll(() => lab?.stop());

async function signIn(page: Page, address: string): Promise<void> {
  await page.goto(`${lab.url}${address}`);
  await page.getByLabel("Name").fill("root");
  await page.getByLabel("Password or token").fill(password);
  await page.keyboard.press("Enter");
}

async function boxOf(place: Locator) {
  const box = await place.boundingBox();
  if (!box) throw new Error(`${String(place)} is not shown`);
  return { ...box, right: box.x + box.width, bottom: box.y + box.height };
}

test("a long name of a device leaves room for its state and its tabs", async ({ page }) => {
  await signIn(page, `#/devices/${NAME}/Create`);
  await expect(page.locator('[data-link="online"]')).toBeVisible();
  for (const size of [TABLET, { width: 1440, height: 900 }, PHONE]) {
    await page.setViewportSize(size);
    expect((await boxOf(page.locator(".service-head"))).height).toBeLessThan(150);
    const [state, tabs] = [await boxOf(page.locator(".link-strip")), await boxOf(page.locator(".tabs"))];
    expect(state.right <= tabs.x || state.bottom <= tabs.y).toBe(true);
    expect(tabs.right).toBeLessThanOrEqual(size.width);
  }
  await expect(page.getByRole("heading", { level: 1 })).toHaveAttribute("title", NAME);
});

test("who has not signed in is shown no places that cannot be visited", async ({ page }) => {
  await page.goto(lab.url);
  await expect(page.getByRole("form", { name: "Sign in" })).toBeVisible();
  await expect(page.getByRole("link", { name: "Recordings" })).toHaveCount(0);
  await signIn(page, "");
  await expect(page.getByRole("link", { name: "Recordings" })).toBeVisible();
});

test("on a phone the stop of agents leaves the page most of its height", async ({ page }) => {
  await page.setViewportSize(PHONE);
  await signIn(page, "");
  await expect(page.getByRole("button", { name: "Stop all agents" })).toBeVisible();
  const [name, theme] = [page.locator(".account"), page.locator(".head .icon-button").last()];
  expect((await boxOf(name)).y).toBeGreaterThan((await boxOf(page.getByRole("link", { name: "Recordings" }))).y);
  expect(Math.abs((await boxOf(name)).bottom - (await boxOf(theme)).bottom)).toBeLessThan(5);
  expect((await boxOf(page.locator(".agents-line"))).height).toBeLessThan(125);
});

test("the tool of a narrow table stands beside its name", async ({ page }) => {
  const board = `{"board":1,"panels":[{"kind":"table","x":0,"y":0,"w":3,"h":6,"settings":{"member":"state"}}]}`;
  await page.setViewportSize(TABLET);
  await signIn(page, `#/devices/${NAME}/Create?view=board&board=${btoa(board)}`);
  const panel = page.locator('[data-panel="table"]');
  await expect(panel.locator('[data-value="x"]')).toBeVisible();
  expect((await boxOf(panel)).width).toBeLessThan(300);
  const [name, tool] = [
    await boxOf(panel.locator(".panel-head")),
    await boxOf(panel.getByRole("button", { name: "JSON" })),
  ];
  expect(tool.bottom).toBeLessThanOrEqual(name.bottom + 4);
  const scroll = panel.locator(".panel-scroll");
  expect(await scroll.evaluate((each) => each.scrollWidth - each.clientWidth)).toBe(0);
});

test("with little room the tools of a board stand beside its stop", async ({ page }) => {
  await signIn(page, `#/devices/${NAME}/Create?view=board`);
  for (const size of [PHONE, UPRIGHT]) {
    await page.setViewportSize(size);
    const stop = await boxOf(page.getByRole("button", { name: "Stop", exact: true }));
    const arrange = await boxOf(page.getByRole("button", { name: "Arrange" }));
    expect(arrange.x).toBeGreaterThan(stop.right);
    expect(Math.abs(arrange.y + arrange.height / 2 - (stop.y + stop.height / 2))).toBeLessThan(6);
  }
});

test("on a phone what is known of a device stands in one column", async ({ page }) => {
  await page.setViewportSize(PHONE);
  await signIn(page, "");
  const facts = page.locator(".device-facts").first().locator("dd");
  await expect(facts).not.toHaveCount(0);
  const starts = await facts.evaluateAll((all) => all.map((each) => Math.round(each.getBoundingClientRect().x)));
  expect(starts.length).toBeGreaterThan(2);
  expect(new Set(starts).size).toBe(1);
});

test("the numbers of a plot's legend stand below each other", async ({ page }) => {
  const board = `{"board":1,"panels":[{"kind":"plot","x":0,"y":0,"w":6,"h":8,"settings":{"member":"state"}}]}`;
  await page.setViewportSize(PHONE);
  await signIn(page, `#/devices/${NAME}/Create?view=board&board=${btoa(board)}`);
  const series = page.locator(".u-legend .u-series");
  await expect(series).toHaveCount(5); // and the time
  const starts = await series.evaluateAll((all) => all.map((each) => Math.round(each.getBoundingClientRect().x)));
  expect(new Set(starts).size).toBe(2);
});
