// The board of an object: panels that are added, arranged by pointer and keyboard, and found again.
import { readFileSync } from "node:fs";
import type { Page, WebSocketRoute } from "@playwright/test";
import { expect, test } from "../lab_test";
import { addPanel, arrange } from "../board";
import { Program, rrgate, startGateway, webRoot } from "../processes";

const panel = (page: Page, name: string) => page.getByRole("group", { name, exact: true });

async function openBoard(page: Page, url: string, object = "create/Create"): Promise<void> {
  await page.goto(`${url}#/devices/${object}?view=board`);
  await expect(page.locator(".board-panel").first()).toBeVisible();
}

test("shows a plot, a table, and a form that calls; a wrong value says where", async ({ page, lab }) => {
  await openBoard(page, lab.url);
  await expect(page.locator('[data-panel="plot"] .u-wrap canvas').first()).toBeVisible();
  await expect(page.locator('[data-panel="plot"] .freshness').first()).toContainText("a second");
  await expect(page.locator('[data-panel="table"] [data-value="heading"]').first()).toHaveText(/^-?\d/);
  const form = panel(page, "Calls");
  await form.getByLabel("Member").selectOption("Drive");
  await form.getByLabel("velocity").fill("40000");
  await form.getByRole("button", { name: "Call Drive" }).click();
  await expect(form.getByRole("alert")).toHaveText("velocity: 40000 is out of range; expected int16, -32768 to 32767");
  await form.getByLabel("velocity").fill("0");
  await form.getByRole("button", { name: "Call Drive" }).click();
  await expect(form.locator("output")).toContainText("done");
  await form.getByText("History: 1").click();
  await expect(form.getByRole("button", { name: "0,0" })).toBeVisible();
  await form.getByText("Copy as code").click();
  await form.getByRole("button", { name: "curl" }).click();
  await expect(form.locator("pre")).toContainText(`curl -X POST '${lab.url}api/v1/devices/create/Create/Drive'`);
});

test("panels are moved and sized by keys and pointer, and are where they were after a reload", async ({
  page,
  lab,
}) => {
  await openBoard(page, lab.url);
  await addPanel(page, "notes");
  const notes = page.locator('[data-panel="notes"]');
  const place = () => notes.evaluate((element) => [element.style.gridColumn, element.style.gridRow]);
  const handle = notes.getByRole("button", { name: /^Move or size/ });
  await handle.focus();
  await notes.getByRole("textbox", { name: "Notes", exact: true }).fill("call Vera at 12");
  await handle.focus();
  for (let i = 0; i < 40; i++) await page.keyboard.press("ArrowUp");
  const before = await place();
  await page.keyboard.press("Shift+ArrowRight");
  const [wider] = await place();
  expect(Number(wider?.split("span ")[1])).toBe(Number(before[0]?.split("span ")[1]) + 1);

  await handle.scrollIntoViewIfNeeded();
  const from = await handle.boundingBox();
  if (!from) throw new Error("the handle has no place on the page");
  const plot = await page.locator('[data-panel="plot"]').first().boundingBox();
  await page.mouse.move(from.x + 5, from.y + 5);
  await page.mouse.down();
  await page.mouse.move(from.x + 305, from.y + 105, { steps: 8 });
  await page.mouse.up();
  const after = await place();
  expect(after).not.toEqual([wider, before[1]]);
  expect(plot).not.toBeNull();

  await page.getByRole("button", { name: "Done" }).click();
  await expect(page.locator('[data-kept="true"]')).toBeVisible();
  await page.reload();
  await expect(notes.getByRole("textbox")).toHaveValue("call Vera at 12");
  expect(await place()).toEqual(after);
});

test("a board goes by its address, and as a file, to another browser", async ({ page, lab, browser }) => {
  await openBoard(page, lab.url);
  await addPanel(page, "notes");
  await page.locator('[data-panel="notes"]').getByRole("textbox", { name: "Notes", exact: true }).fill("für alle");
  await expect(page.locator('[data-kept="true"]')).toBeVisible();
  const address = page.url();
  expect(address).toContain("&board=");
  const saved = page.waitForEvent("download");
  await page.getByRole("button", { name: "Save file" }).click();
  const file = await (await saved).path();
  expect(JSON.parse(readFileSync(file, "utf8"))).toMatchObject({ board: 1 });

  const other = await (await browser.newContext()).newPage();
  await other.goto(address);
  await expect(other.locator('[data-panel="notes"]').getByRole("textbox")).toHaveValue("für alle");
  await other.context().close();

  const third = await (await browser.newContext()).newPage();
  await openBoard(third, lab.url);
  await expect(third.locator('[data-panel="notes"]')).toHaveCount(0);
  await third.getByLabel("Board file").setInputFiles(file);
  await expect(third.locator('[data-panel="notes"]').getByRole("textbox")).toHaveValue("für alle");
  await third.getByLabel("Board file").setInputFiles({
    name: "x.json",
    mimeType: "application/json",
    buffer: Buffer.from('{"board":1,"panels":[{"kind":"oven"}]}'),
  });
  await expect(third.locator("main").getByRole("alert").first()).toContainText(
    '/panels/0/kind is "oven", expected one of plot',
  );
  await third.context().close();
});

test("the address has the board that this browser kept, and an address that is opened again shows its own", async ({
  page,
  lab,
}) => {
  await openBoard(page, lab.url);
  await addPanel(page, "notes");
  const notes = page.locator('[data-panel="notes"]').getByRole("textbox", { name: "Notes", exact: true });
  await notes.fill("first");
  await expect(page.locator('[data-kept="true"]')).toBeVisible();
  const first = page.url();
  await notes.fill("second");
  await expect(page).not.toHaveURL(first);
  await expect(page.locator('[data-kept="true"]')).toBeVisible();
  const second = page.url();

  await page.goto("about:blank");
  await openBoard(page, lab.url);
  await expect(notes).toHaveValue("second");
  await expect(page).toHaveURL(second);

  const open = (address: string) => page.evaluate((to) => void (location.href = to), address);
  await open(first);
  await expect(notes).toHaveValue("first");
  await notes.fill("third");
  await expect(page).not.toHaveURL(first);
  await expect(page.locator('[data-kept="true"]')).toBeVisible();
  await open(first);
  await expect(notes).toHaveValue("first");
});

test("a plot shows several members, in the address and after a reload", async ({ page, lab }) => {
  await openBoard(page, lab.url);
  await arrange(page);
  await page.getByRole("button", { name: "Reset board" }).click();
  await addPanel(page, "plot");
  const plot = page.locator('[data-panel="plot"]').last();
  await plot.getByLabel("Member").selectOption("DistanceTraveled");
  const canvas = plot.getByRole("img");
  await expect(canvas).toHaveAccessibleName("Plot of DistanceTraveled");
  await plot.getByLabel("Add to the plot").selectOption("state");
  await plot.getByText(/^Series: /).click();
  for (const name of ["state.y", "state.velocity", "state.heading"])
    await plot.getByRole("checkbox", { name }).uncheck();
  await expect(canvas).toHaveAccessibleName("Plot of DistanceTraveled, state.x");
  const legend = plot.locator(".u-legend");
  await expect(legend).toHaveText(/^Time0\.00 sDistanceTraveled-?\d+state\.x-?\d/);
  const saved = page.waitForEvent("download");
  await plot.getByRole("button", { name: "CSV" }).click();
  const download = await saved;
  expect(download.suggestedFilename()).toBe("DistanceTraveled-state.csv");
  expect(readFileSync(await download.path(), "utf8")).toMatch(/^time_s,DistanceTraveled,state\.x\n[^]*,,-?\d/);

  await expect(page.locator('[data-kept="true"]')).toBeVisible();
  await page.reload();
  await expect(canvas).toHaveAccessibleName("Plot of DistanceTraveled, state.x");
  await expect(page.getByRole("group", { name: "DistanceTraveled, state" })).toBeVisible();
  await arrange(page);
  await plot.getByRole("button", { name: "Take state off the plot" }).click();
  await expect(canvas).toHaveAccessibleName("Plot of DistanceTraveled");
});

test("the axis of a plot has the unit that all its series have", async ({ page }) => {
  const demo = new Program(rrgate, ["demo", "microassembly", "--port", "0", "--no-browser"]);
  demo.start();
  const [cameras = ""] = await demo.waitForOutput(/rr\+tcp:\S+service=Cameras/);
  const gateway = await startGateway("cameras", cameras, webRoot);
  try {
    const panels = [{ kind: "plot", x: 0, y: 0, w: 6, h: 8, settings: { member: "focus", paths: ["[0]", "[1]"] } }];
    const board = Buffer.from(JSON.stringify({ board: 1, panels })).toString("base64url");
    await page.goto(`${gateway.url}#/devices/cameras/Cameras?view=board&board=${board}`);
    const plot = page.getByRole("img", { name: "Plot of [0] [mm], [1] [mm]" });
    await expect(plot).toHaveAttribute("data-unit", "mm");
  } finally {
    await gateway.program.kill("SIGTERM");
    await demo.kill("SIGTERM");
  }
});

test("a removed panel and a replaced board come back by Undo, until the next change", async ({ page, lab }) => {
  await openBoard(page, lab.url);
  await addPanel(page, "notes");
  const notes = page.locator('[data-panel="notes"]');
  const text = notes.getByRole("textbox", { name: "Notes", exact: true });
  const place = () => notes.evaluate((element) => [element.style.gridColumn, element.style.gridRow]);
  await text.fill("call Vera at 12");
  const before = await place();
  const undo = page.getByRole("button", { name: "Undo" });
  await notes.getByRole("button", { name: "Remove Notes" }).click();
  await expect(notes).toHaveCount(0);
  await expect(page.getByRole("status").filter({ hasText: "Removed: Notes" })).toBeVisible();
  await expect(undo).toBeFocused();
  await expect(undo).toBeInViewport({ ratio: 1 });
  await page.keyboard.press("Enter");
  await expect(text).toHaveValue("call Vera at 12");
  expect(await place()).toEqual(before);
  await expect(undo).toBeHidden();

  await arrange(page);
  await page.getByRole("button", { name: "Reset board" }).click();
  await expect(notes).toHaveCount(0);
  await undo.click();
  await expect(text).toHaveValue("call Vera at 12");
  await page.getByLabel("Board file").setInputFiles({
    name: "empty.json",
    mimeType: "application/json",
    buffer: Buffer.from('{"board":1,"panels":[]}'),
  });
  await expect(page.locator(".board-panel")).toHaveCount(0);
  await undo.click();
  await expect(text).toHaveValue("call Vera at 12");
  await expect(page.locator('[data-kept="true"]')).toBeVisible();
  await page.reload();
  await expect(text).toHaveValue("call Vera at 12");

  await arrange(page);
  await page.getByRole("button", { name: "Reset board" }).click();
  await addPanel(page, "locks");
  await expect(page.locator('[data-panel="locks"]')).toBeVisible();
  await expect(undo).toBeHidden();
});

test("a frozen device is seen within a second, and its values say how old they are", async ({ page, lab }) => {
  await openBoard(page, lab.url);
  await expect(page.locator('[data-panel="plot"] .freshness').first()).toContainText("a second");
  lab.create.signal("SIGSTOP");
  try {
    await expect(page.locator(".board-silent")).toBeVisible({ timeout: 1_500 });
    await expect(page.locator('[data-panel="table"] [data-stale="true"]').first()).toContainText(
      /Stale: \d\.\d s old/,
      {
        timeout: 1_000,
      },
    );
  } finally {
    lab.create.signal("SIGCONT");
  }
  await expect(page.locator(".board-silent")).toBeHidden();
  await expect(page.locator('[data-panel="table"] [data-stale="true"]')).toHaveCount(0);
});

test("the stop is sent at once and its arrival is said, also while another call hangs", async ({ page, lab }) => {
  await openBoard(page, lab.url);
  await page.getByRole("button", { name: "Stop", exact: true }).click();
  await expect(page.locator('[data-stop="arrived"]')).toHaveText(/^arrived after \d+ ms/);
  lab.create.signal("SIGSTOP"); // calls hang from here on
  await panel(page, "Calls")
    .getByRole("button", { name: /^Call / })
    .click();
  await page.keyboard.press("Escape");
  await expect(page.locator('[data-stop="sent"]')).toBeVisible();
  lab.create.signal("SIGCONT");
  await expect(page.locator('[data-stop="arrived"]')).toBeVisible();
  await lab.create.kill();
  await page.keyboard.press("Escape");
  await expect(page.locator('[data-stop="failed"]')).toContainText("NOT STOPPED", { timeout: 5_000 });
  await expect(page.locator('[data-link="lost"]')).toBeVisible(); // the stop hears of it first
  lab.create.start();
  await lab.waitUntilOnline();
  await expect(page.locator('[data-link="online"]')).toBeVisible({ timeout: 30_000 });
  // The gateway finds the device at once, and opens the session with its service by a back-off.
  await expect(async () => {
    await page.keyboard.press("Escape");
    await expect(page.locator('[data-stop="arrived"]')).toBeVisible({ timeout: 1_000 });
  }).toPass();
});

test("the stop reaches a device that the gateway takes for offline, and one without connection by the gateway", async ({
  page,
  lab,
}) => {
  const sockets: WebSocketRoute[] = [];
  let isRefused = false;
  await page.routeWebSocket(/devices\/create/, (socket) => {
    if (isRefused) return void socket.close();
    socket.connectToServer();
    sockets.push(socket);
  });
  const robot = `${lab.url}api/v1/devices/create/Create/`;
  const velocity = async () =>
    ((await (await page.request.get(`${robot}state`)).json()) as { velocity: number }).velocity;
  const drive = async () => {
    expect((await page.request.post(`${robot}Drive`, { data: { velocity: 100, radius: 32767 } })).ok()).toBe(true);
    await expect.poll(velocity).toBeGreaterThan(0);
  };
  await openBoard(page, lab.url);
  await page.route("**/api/v1/devices", async (route) => {
    const response = await route.fetch();
    const json = (await response.json()) as { devices: { name: string; state: string }[] };
    for (const device of json.devices) if (device.name === "create") device.state = "offline";
    await route.fulfill({ response, json });
  });
  await expect(page.locator('[data-link="lost"]')).toBeVisible();
  await expect(panel(page, "Calls").getByRole("button", { name: /^Call / })).toBeDisabled();
  await drive();
  await page.keyboard.press("Escape");
  await expect(page.locator('[data-stop="arrived"]')).toBeVisible();
  await expect.poll(velocity).toBe(0);

  await page.getByRole("link", { name: "Drive" }).click();
  await drive();
  await page.getByRole("button", { name: "Stop", exact: true }).click();
  await expect.poll(velocity).toBe(0);

  isRefused = true;
  for (const socket of sockets) await socket.close();
  await drive();
  await page.keyboard.press("Escape");
  await expect.poll(velocity).toBe(0);
  await expect(page.getByRole("region", { name: "Drive" })).toContainText("passed on by the gateway after");
  await page.getByRole("link", { name: "Board" }).click();
  await drive();
  await page.getByRole("button", { name: "Stop", exact: true }).click();
  await expect.poll(velocity).toBe(0);
  await expect(page.locator('[data-stop="passed"]')).toBeVisible();
  await page.route("**/Create?lease=take*", (route) => route.fulfill({ status: 503, json: { detail: "offline" } }));
  await page.getByRole("link", { name: "Drive" }).click();
  await expect(page.getByRole("region", { name: "Drive" })).toBeVisible();
  await page.keyboard.press("Escape");
  await expect(page.getByRole("region", { name: "Drive" })).toContainText("NOT STOPPED: offline");
});

test("a board whose code and style did not come has the Stop of the page, and is there with both once they come", async ({
  page,
  lab,
}) => {
  let isAway = true;
  await page.route(/board_page-.*\.(js|css)/, (route) => (isAway ? route.abort() : route.continue()));
  await page.goto(`${lab.url}#/devices/create/Create?view=board`);
  await expect(page.getByRole("button", { name: "Load the page again" })).toBeVisible();
  await page.getByRole("button", { name: "Stop", exact: true }).click();
  await expect(page.locator('[data-stop="arrived"]')).toBeVisible();
  isAway = false;
  await expect(page.locator(".board")).toHaveCSS("display", "grid");
});

test("a panel that fails says so, can be tried again, and leaves the rest of the board as it is", async ({
  page,
  lab,
}) => {
  const body = 'export default () => { if (!globalThis.isMended) throw new Error("an odd panel"); return "mended"; }';
  await page.route("**/notes_panel-*.js", (route) => route.fulfill({ contentType: "text/javascript", body }));
  await openBoard(page, lab.url);
  await addPanel(page, "notes");
  const notes = page.locator('[data-panel="notes"]');
  await expect(notes.getByRole("alert").filter({ hasText: "an odd panel" })).toBeVisible();
  await expect(page.locator('[data-panel="plot"] .freshness').first()).toContainText("a second");
  await page.evaluate(() => ((globalThis as { isMended?: boolean }).isMended = true));
  await notes.getByRole("button", { name: "Try again" }).click();
  await expect(notes).toContainText("mended");
  await page.goto(
    `${lab.url}#/devices/create/Create?view=board&board=${btoa(
      '{"board":1,"panels":[{"kind":"notes","from":"100%","x":0,"y":0,"w":4,"h":4}]}',
    )}`,
  );
  await expect(page.getByRole("alert").filter({ hasText: '/panels/0/from is "100%"' })).toBeVisible();
  await page.getByRole("button", { name: "Stop", exact: true }).click();
  await expect(page.locator('[data-stop="arrived"]')).toBeVisible();
});

test("a camera of another device stands beside the robot, with an object of its own", async ({ page, lab }) => {
  await openBoard(page, lab.url);
  await panel(page, "Left camera").getByRole("button", { name: "Start stream" }).click();
  await expect(panel(page, "Left camera").locator(".panel-foot")).toContainText("320 × 240");
  await expect(panel(page, "Left camera").getByRole("button", { name: "Start stream" })).toBeHidden();
  await addPanel(page, "image");
  const image = page.locator('[data-panel="image"]').last();
  await image.getByLabel("Service").selectOption("webcams/Webcam");
  await image.getByRole("textbox", { name: /^Object of/ }).fill("Webcams[1]");
  await image.getByRole("textbox", { name: /^Object of/ }).press("Enter");
  await image.getByLabel("Member").selectOption("FrameStream");
  await image.getByRole("button", { name: "Start stream" }).click();
  await expect(image.locator(".panel-foot")).toContainText("320 × 240");
  await image.getByLabel("Member").selectOption("CaptureFrame");
  await image.getByRole("button", { name: "Take" }).click();
  await expect(image.locator(".panel-foot")).toContainText("320 × 240");
});
