// Signing in at the dashboard of a gateway that asks who one is.
import { expect, test } from "@playwright/test";
import type { Locator, Page } from "@playwright/test";
import { existsSync, readFileSync } from "node:fs";
import { createServer } from "node:http";
import path from "node:path";
import { GuardedLab, password } from "../guarded_lab";
import { freePort, repositoryRoot, webRoot } from "../processes";

let lab: GuardedLab;
let otherPage: string;

test.beforeAll(async () => {
  otherPage = `http://127.0.0.1:${await freePort()}`;
  lab = await GuardedLab.start(webRoot, { more: { ["allowed_origins"]: [otherPage] } });
});

test.afterAll(() => lab?.stop());

const form = (page: Page) => page.getByRole("form", { name: "Sign in" });
const signOut = (page: Page) => page.getByRole("button", { name: "Sign out" });

/** @returns the URLs for which the browser would open its own dialog. */
async function watchDialogs(page: Page): Promise<string[]> {
  const dialogs: string[] = [];
  const browser = await page.context().newCDPSession(page);
  // A page that is loaded again gives up what it has asked for.
  const goOn = (requestId: string) => browser.send("Fetch.continueRequest", { requestId }).catch(() => undefined);
  browser.on("Fetch.requestPaused", ({ requestId }) => void goOn(requestId));
  browser.on("Fetch.authRequired", ({ requestId, request }) => {
    dialogs.push(request.url);
    void browser.send("Fetch.continueWithAuth", { requestId, authChallengeResponse: { response: "CancelAuth" } });
  });
  await browser.send("Fetch.enable", { handleAuthRequests: true });
  return dialogs;
}

async function signIn(page: Page, name: string, secret: string): Promise<void> {
  await page.getByLabel("Name").fill(name);
  await page.getByLabel("Password or token").fill(secret);
  await page.keyboard.press("Enter");
}

test("a wrong password is told; the right one shows the devices, in all tabs until signing out", async ({
  page,
  context,
}) => {
  const dialogs = await watchDialogs(page);
  const refused: string[] = [];
  page.on("response", (answer) => void (answer.status() === 401 && refused.push(new URL(answer.url()).pathname)));
  await page.goto(lab.url);
  await expect(form(page)).toBeVisible();
  await expect(page.getByLabel("Name")).toBeFocused();
  await page.getByLabel("Name").fill("vera");
  await page.waitForResponse(/\/api\/v1\/access\?/); // the page looks again: what is typed stays
  await expect(page.getByLabel("Name")).toBeFocused();
  await expect(page.getByLabel("Name")).toHaveValue("vera");
  await signIn(page, "root", "wrong");
  await expect(page.getByRole("alert")).toHaveText("Wrong name or password.");
  await expect(page.getByLabel("Name")).toHaveValue("root");
  expect(refused).toEqual(["/api/v1/session"]);

  await signIn(page, "root", password);
  await expect(page.getByRole("heading", { name: "Devices" })).toBeVisible();
  await expect(page.getByText("create", { exact: true })).toBeVisible();
  await expect(page.getByRole("group", { name: "You" })).toContainText("root admin");

  await page.reload();
  await expect(page.getByText("create", { exact: true })).toBeVisible();
  const other = await context.newPage();
  await other.goto(lab.url);
  await expect(other.getByText("create", { exact: true })).toBeVisible();
  const kept = await page.evaluate(() => JSON.stringify([{ ...localStorage }, { ...sessionStorage }, document.cookie]));
  expect(kept).not.toContain(password);
  expect(kept).not.toContain("rrgate");
  const [cookie] = await context.cookies(lab.url);
  expect(cookie).toMatchObject({ httpOnly: true, sameSite: "Strict", path: "/" });

  await signOut(page).click();
  await expect(form(page)).toBeVisible();
  await expect(form(other)).toBeVisible();
  await expect(other.getByRole("alert")).toHaveText("The gateway no longer accepts this sign-in.");
  await other.close();
  await context.addCookies([cookie!]);
  await expect(page.getByText("create", { exact: true })).toBeHidden();
  await page.reload();
  await expect(form(page)).toBeVisible();
  expect(dialogs).toEqual([]);
});

test("a device is connected with tickets, again after a restart of the gateway; a token does too", async ({ page }) => {
  await page.goto(`${lab.url}#/devices/create/Create`);
  await signIn(page, "", lab.token);
  await expect(page.locator('[data-link="online"]')).toBeVisible();
  await lab.gateway.kill();
  await expect(page.locator('[data-link="lost"]')).toBeVisible();
  lab.gateway.start();
  await lab.waitUntilOnline();
  await expect(page.locator('[data-link="online"]')).toBeVisible();
  await signOut(page).click();
  await expect(form(page)).toBeVisible();
});

test("a page of another origin that is allowed lists the devices, and connects to one with a token", async ({
  page,
}) => {
  const site = createServer(({ url = "/" }, answer) => {
    if (url === "/") return void answer.setHeader("Content-Type", "text/html").end("<!doctype html>");
    const file = path.join(repositoryRoot, "wasm-client/dist", url);
    if (!existsSync(file)) return void answer.writeHead(404).end(); // the browser looks for an icon
    const type = url.endsWith(".js") ? "text/javascript" : "application/wasm";
    answer.setHeader("Content-Type", type).end(readFileSync(file));
  });
  await new Promise<void>((resolve) => site.listen(Number(new URL(otherPage).port), "127.0.0.1", resolve));
  await page.goto(otherPage);
  interface Robot {
    readonly DistanceTraveled: { get(): Promise<number> };
    readonly $: { close(): Promise<void> };
  }
  interface Client {
    connect(url: string, options: { token: string }): Promise<Robot>;
  }
  const use = async ({ gateway, token, module }: { gateway: string; token: string; module: string }) => {
    const { connect } = (await import(module)) as Client;
    const list = await fetch(`${gateway}api/v1/devices`, { headers: { ["Authorization"]: `Bearer ${token}` } });
    const { devices } = (await list.json()) as { devices: { name: string }[] };
    const url = `${gateway.replace("http", "ws")}devices/create?service=Create`;
    const robot = await connect(url, { token });
    const travelled = await robot.DistanceTraveled.get();
    await robot.$.close();
    const refused = await connect(url, { token: "wrong" }).catch((error: Error) => error.name);
    return { devices: devices.map((device) => device.name), travelled, refused };
  };
  const given = { gateway: lab.url, token: lab.token, module: `${otherPage}/index.js` };
  expect(await page.evaluate(use, given)).toEqual({
    devices: ["create"],
    travelled: 0,
    refused: "RobotRaconteur.AuthenticationError",
  });
  site.close();
});

test("who asks for access is given a token by somebody who may, and is in with it", async ({ page, browser }) => {
  await page.goto(lab.url);
  await page.getByText("Ask for access").first().click();
  await page.getByLabel("Ask as").fill("tablet");
  await page.getByLabel("What for").fill("cell 3");
  await page.keyboard.press("Enter");
  await expect(page.locator('[data-ask="waiting"]')).toContainText("as tablet");
  const other = await (await browser.newContext()).newPage();
  await other.goto(lab.url);
  await signIn(other, "root", password);
  const request = other.locator('[data-request="tablet"]');
  await expect(request).toContainText("cell 3");
  await expect(async () => {
    await request.getByRole("button", { name: "Approve" }).click(); // not before it has been seen
    await expect(request).toBeHidden({ timeout: 200 });
  }).toPass();
  await expect(page.locator(".ask-token")).toHaveText(/^rrg_/);
  await page.getByRole("button", { name: "Sign in with this token" }).click();
  await expect(page.getByRole("group", { name: "You" })).toContainText("viewer");
  await other.context().close();
});

test.describe("with its service worker", () => {
  test.use({ serviceWorkers: "allow" });

  test("what agents ask for is shown to who decides, with who, what and why, and is answered", async ({
    page,
    context,
  }) => {
    await context.grantPermissions(["notifications"]);
    const answers: (string | null)[] = [];
    let approvals = [
      {
        id: "a1",
        user: "bot",
        client: "10.0.0.5",
        device: "create",
        path: "Create",
        member: "Drive",
        verb: "call",
        values: { velocity: 100 },
        why: "to see the door",
        ["expires_in"]: 20,
      },
    ];
    await page.route("**/api/v1/agents/approvals", (route) =>
      route.fulfill({ json: { approvals, ["stopped_for"]: 0 } }),
    );
    await page.route("**/api/v1/agents/approvals/a1", async (route) => {
      answers.push(route.request().postData());
      approvals = [];
      await route.fulfill({ json: { state: "allowed" } });
    });
    await page.goto(lab.url);
    await signIn(page, "root", password);
    const approval = page.locator('[data-approval="a1"]');
    for (const words of ["bot", "create · Create.Drive", '{"velocity":100}', "to see the door"])
      await expect(approval).toContainText(words);
    await page.evaluate(() => Object.defineProperty(document, "hidden", { get: () => true }));
    const notices = (): Promise<string[]> =>
      page.evaluate(async () => {
        const worker = await navigator.serviceWorker.ready;
        return (await worker.getNotifications()).map(({ title, body }) => `${title} ${body}`);
      });
    await expect.poll(notices).toEqual(["The agent of bot asks to do this: create · Create.Drive"]);
    await expect(async () => {
      await approval.getByRole("button", { name: "Allow once" }).click(); // not before it has been seen
      await expect(approval).toBeHidden({ timeout: 200 });
    }).toPass();
    await expect.poll(notices).toEqual([]);
    expect(answers).toEqual(['{"answer":"once"}']);
    await expect(page.getByRole("button", { name: "Stop all agents" })).toBeVisible();
  });
});

test("what agents ask for moves nothing, covers no Stop, and is not allowed by a press that was meant for something else", async ({
  page,
}) => {
  test.slow(); // three pages in three sizes, each of which waits for the gateway to be asked
  const ask = (id: string) => ({
    id,
    device: "create",
    path: "Create",
    member: "Drive",
    verb: "call",
    ["expires_in"]: 20,
  });
  let approvals: object[] = [];
  const allowed: string[] = [];
  await page.route("**/api/v1/agents/approvals", (route) => route.fulfill({ json: { approvals, ["stopped_for"]: 0 } }));
  await page.route("**/api/v1/agents/approvals/*", async (route) => {
    allowed.push(route.request().url().slice(-2));
    approvals = approvals.slice(1);
    await route.fulfill({ json: { state: "allowed" } });
  });
  await page.goto(lab.url);
  await signIn(page, "root", password);
  const stop = page.getByRole("button", { name: "Stop", exact: true });
  const stopAgents = page.getByRole("button", { name: "Stop all agents" });
  const placeOf = (button: Locator) =>
    button.evaluate((element) => {
      const { x, y, width, height } = element.getBoundingClientRect();
      return { x, y, isSeen: element.contains(document.elementFromPoint(x + width / 2, y + height / 2)) };
    });
  const seen = async () => ({ ...(await placeOf(stop)), agents: await placeOf(stopAgents) });
  for (const [width, height] of [
    [1280, 800],
    [412, 839],
    [839, 412],
  ] as const) {
    await page.setViewportSize({ width, height });
    for (const view of ["drive", "board", "members"]) {
      approvals = [];
      await page.goto(`${lab.url}#/devices/create/Create?view=${view}`);
      await expect(page.locator('[data-approvals="0"]')).toBeVisible();
      await expect(page.locator('[data-link="online"]')).toBeVisible();
      if (view === "drive") await expect(page.locator('[data-reading="packets"]')).toContainText("a second");
      await stop.scrollIntoViewIfNeeded();
      const before = await seen();
      expect(before.isSeen).toBe(true);
      approvals = [ask("a1"), ask("a2"), ask("a3")];
      await expect(page.locator('[data-approval="a3"]')).toBeVisible();
      expect(await seen(), `${view}, ${width} wide`).toEqual(before);
    }
  }

  const pressWhenChanged = (id: string) =>
    page.evaluate(
      (wanted) =>
        new Promise<void>((resolve) => {
          const look = (): void => {
            const first = document.querySelector<HTMLElement>("[data-approval]");
            if (first?.dataset["approval"] !== wanted) return;
            observer.disconnect();
            first.querySelector("button")?.click();
            resolve();
          };
          const observer = new MutationObserver(look);
          observer.observe(document.body, { childList: true, subtree: true });
          look();
        }),
      id,
    );
  approvals = [];
  await expect(page.locator('[data-approvals="0"]')).toBeVisible();
  const pressed = pressWhenChanged("a1");
  approvals = [ask("a1"), ask("a2")];
  await pressed;
  const moved = pressWhenChanged("a2");
  await expect(async () => {
    await page.locator('[data-approval="a1"]').getByRole("button", { name: "Allow once" }).click({ timeout: 1_000 });
    await expect(page.locator('[data-approval="a1"]')).toBeHidden({ timeout: 200 });
  }).toPass();
  await moved;
  await expect(page.locator('[data-approval="a2"]')).toBeVisible();
  expect(allowed).toEqual(["a1"]);
});

test("Stop all agents says what became of it, and the page how old its news of agents are", async ({ page }) => {
  let isAway = false;
  await page.route("**/api/v1/agents/approvals", (route) =>
    isAway ? route.abort() : route.fulfill({ json: { approvals: [], ["stopped_for"]: 0 } }),
  );
  await page.route("**/api/v1/agents/stop", (route) => (isAway ? undefined : route.fulfill({ json: {} })));
  await page.goto(lab.url);
  await signIn(page, "root", password);
  const agents = page.getByRole("region", { name: "Agents" });
  const before = (await agents.boundingBox())?.height;
  await agents.getByRole("button", { name: "Stop all agents" }).click();
  await expect(agents.locator('[data-stop="arrived"]')).toBeVisible();
  isAway = true;
  await expect(agents.locator("[data-silence]")).toContainText("the gateway cannot be reached");
  await agents.getByRole("button", { name: "Stop all agents" }).click();
  await expect(agents.locator('[data-stop="sent"]')).toBeVisible();
  await expect(agents.locator('[data-stop="failed"]')).toHaveText("NOT STOPPED: the gateway did not answer in time");
  expect((await agents.boundingBox())?.height).toBe(before);
});

test("the form fits a phone and is used with the keyboard", async ({ page }) => {
  await page.setViewportSize({ width: 320, height: 568 });
  await page.goto(lab.url);
  await page.getByLabel("Name").fill("vera");
  await page.keyboard.press("Tab");
  await page.keyboard.type(password);
  await page.keyboard.press("Tab");
  await expect(page.getByRole("button", { name: "Sign in" })).toBeFocused();
  const overflow = () =>
    page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
  expect(await overflow()).toBeLessThanOrEqual(0);
  await page.keyboard.press("Enter");
  await expect(signOut(page)).toBeVisible();
  await expect.poll(overflow).toBeLessThanOrEqual(0); // once the list is there
  const box = await signOut(page).boundingBox();
  expect((box?.x ?? 999) + (box?.width ?? 999)).toBeLessThanOrEqual(320);
});

test("what agents have done is listed for who decides about them, as it happens", async ({ page }) => {
  const open = await GuardedLab.start(webRoot, { more: { mcp: {} } });
  const tell = async (method: string, params: object) => {
    const headers = { Authorization: `Bearer ${open.token}`, ["Content-Type"]: "application/json", ...session };
    const body = JSON.stringify({ jsonrpc: "2.0", id: 1, method, params });
    return fetch(`${open.url}mcp`, { method: "POST", headers, body });
  };
  let session = {};
  try {
    await page.goto(open.url);
    await signIn(page, "root", password);
    const list = page.locator("details", { hasText: "What agents do" });
    await list.getByText("What agents do").click();
    await expect(list).toContainText("knows of no agent");
    const begun = await tell("initialize", { clientInfo: { name: "<b>mind</b>", version: "1.2" } });
    session = { ["Mcp-Session-Id"]: begun.headers.get("Mcp-Session-Id") };
    const call = (name: string, given: object) =>
      tell("tools/call", { name, arguments: { device: "create", why: "to see", ...given } });
    await call("read", { path: "Create/DistanceTraveled" });
    await call("call", { path: "Create/Drive", args: { velocity: 100, radius: 5000 } });
    await call("stop", { path: "Create" });
    await expect(list).toContainText("<b>mind</b> 1.2");
    const rows = list.getByRole("row");
    await expect(rows).toHaveCount(3);
    await expect(rows.nth(2)).toContainText("create · Create/Drive");
    await expect(rows.nth(2)).toContainText('"velocity":100');
    await expect(rows.nth(2)).toContainText('no rule with "agent"');
    await expect(rows.nth(1)).toContainText("create · Create");
    await page.setViewportSize({ width: 360, height: 700 });
    expect(await page.evaluate(() => document.documentElement.scrollWidth)).toBeLessThanOrEqual(360);
  } finally {
    await open.stop();
  }
});

for (const [view, content] of [
  ["drive", ".pad"],
  ["board", ".board"],
  ["members", "[data-member]"],
] as const) {
  test(`Stop stays in reach when the sign-in has expired, and stops the robot: ${view}`, async ({ page, context }) => {
    const headers = { Authorization: `Bearer ${lab.token}`, ["Content-Type"]: "application/json" };
    const robot = `${lab.url}api/v1/devices/create/Create`;
    const distance = async () => (await fetch(`${robot}/DistanceTraveled`, { headers })).text();
    const drive = (velocity: number) =>
      fetch(`${robot}/Drive`, { method: "POST", headers, body: JSON.stringify({ velocity, radius: 2000 }) });
    const stop = page.getByRole("button", { name: "Stop", exact: true });
    await page.setViewportSize({ width: 412, height: 700 });
    await page.goto(`${lab.url}#/devices/create/Create?view=${view}`);
    await signIn(page, "root", password);
    await expect(page.locator('[data-link="online"]')).toBeVisible();
    await expect(stop).toBeVisible();
    await context.clearCookies();
    await expect(form(page)).toBeVisible();
    await expect(page.getByRole("alert")).toHaveText("The gateway no longer accepts this sign-in.");
    await expect(page.getByLabel("Password or token")).toBeInViewport();
    await expect(page.locator(content).filter({ visible: true })).toHaveCount(0);
    for (const press of [() => stop.click(), () => page.keyboard.press("Escape")]) {
      expect((await drive(30)).ok).toBe(true);
      await expect(stop).toBeInViewport({ ratio: 1 });
      await press();
      await expect(page.locator('[data-stop="arrived"]')).toBeVisible();
      let before = "";
      await expect(async () => {
        const now = await distance();
        const last = before;
        before = now;
        expect(now).toBe(last);
      }).toPass({ intervals: [300] });
    }
    await signIn(page, "root", password);
    await expect(form(page)).toBeHidden();
    await expect(page.locator(content).first()).toBeVisible();
  });
}

test("Stop says that it needs a sign-in once the gateway has ended the connection, and works after it", async ({
  page,
  context,
}) => {
  await page.goto(`${lab.url}#/devices/create/Create`);
  await signIn(page, "root", password);
  await expect(page.locator('[data-link="online"]')).toBeVisible();
  const other = await context.newPage();
  await other.goto(lab.url);
  await signOut(other).click();
  await expect(form(page)).toBeVisible();
  const stop = page.getByRole("button", { name: "Stop", exact: true });
  await expect(page.locator('[data-link="lost"]')).toBeVisible();
  await stop.click();
  await expect(page.locator('[data-stop="failed"]')).toHaveText(
    "NOT STOPPED: not connected: nothing was sent. Sign in, then press Stop again.",
  );
  await signIn(page, "root", password);
  await expect(page.locator('[data-link="online"]')).toBeVisible();
  await expect(page.getByRole("button", { name: "Forward" })).toBeEnabled();
});

test("Stop asks the gateway to make the device safe also after the sign-in, and says why it may not be", async ({
  page,
  context,
}) => {
  const leases = { safe: [{ call: "Create.Drive", arguments: [0, 0] }] };
  const shared = await GuardedLab.start(webRoot, { device: { mode: "shared", leases } });
  try {
    await page.goto(`${shared.url}#/devices/create/Create?view=members`);
    await signIn(page, "root", password);
    await expect(page.locator('[data-link="online"]')).toBeVisible();
    const other = await context.newPage();
    await other.goto(shared.url);
    await signOut(other).click();
    await expect(form(page)).toBeVisible();
    await expect(page.locator('[data-link="lost"]')).toBeVisible();
    const asked = page.waitForRequest(/Create\?lease=take/);
    await page.getByRole("button", { name: "Stop", exact: true }).click();
    await asked;
    await expect(page.locator('[data-stop="failed"]')).toHaveText(
      /^NOT STOPPED: .*[^.]\. Sign in, then press Stop again\.$/,
    );
  } finally {
    await shared.stop();
  }
});
