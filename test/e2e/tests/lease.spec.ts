// A page that drives the demo's robot under a lease, and freezes. What the robot was told is read at the robot, by a client that
// comes by no gateway; page and test have one clock.
import { cpSync, mkdtempSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";
import { pathToFileURL } from "node:url";
import { expect, test } from "@playwright/test";
import type { Page } from "@playwright/test";
import type * as Client from "../../../wasm-client/dist/node.js";
import { deviceProgram, freePort, Program, repositoryRoot, startGateway } from "../processes";

const deadman = 200;
/** Milliseconds from the moment in which the page freezes until the robot stands. */
const soon = 300;

let create: Program;
let gateway: { program: Program; url: string };
let robot: Client.RemoteObject;
/** When the robot was heard of with each speed that is not that before. */
const speeds: { at: number; speed: number }[] = [];

test.beforeAll(async () => {
  const site = mkdtempSync(path.join(tmpdir(), "rrgate-site-"));
  const dist = path.join(repositoryRoot, "wasm-client/dist");
  cpSync(dist, site, { recursive: true });
  writeFileSync(path.join(site, "index.html"), "<!doctype html><title>client</title>");
  const port = await freePort();
  create = new Program(deviceProgram("rrgate-demo-create"), ["--port", String(port)]);
  create.start();
  const url = `rr+tcp://127.0.0.1:${port}/?service=Create`;
  const leases = {
    members: [{ member: "Create.Drive", lease: "required" }],
    safe: [{ call: "Create.Drive", arguments: [0, 0] }],
    takeover: ["*"],
  };
  const devices = [{ name: "create", url, mode: "shared", leases }];
  gateway = await startGateway("create", url, site, { devices });
  const { connect } = (await import(pathToFileURL(path.join(dist, "node.js")).href)) as typeof Client;
  robot = await connect(`ws://127.0.0.1:${port}/?service=Create`);
  void follow();
});

test.afterAll(async () => {
  await robot?.$.close();
  await gateway?.program.kill("SIGTERM");
  await create?.kill("SIGTERM");
});

async function follow(): Promise<void> {
  for await (const state of robot["state"]!.connect() as AsyncIterable<{ velocity: number }>) {
    const speed = state.velocity;
    if (speeds.at(-1)?.speed !== speed) speeds.push({ at: Date.now(), speed });
  }
}

/** Connects, takes the lease, drives; the page's `lab` has what was made of it. */
async function drive(page: Page, time = deadman, entry = "index.js"): Promise<void> {
  await page.goto(gateway.url);
  await page.evaluate(
    async ([milliseconds, script]) => {
      const { connect, lease } = await import(new URL(script, location.href).href);
      const driven = await connect("/devices/create?service=Create");
      await driven.reset();
      const held = await lease(driven, { deadman: milliseconds });
      const lab = { driven, held, lost: "" };
      held.onLost((reason: Error) => (lab.lost = reason.message));
      Object.assign(window, { lab });
      await driven.Drive(50, 32767);
    },
    [time, entry] as const,
  );
  await expect.poll(() => speeds.at(-1)?.speed).toBeGreaterThan(0);
}

const lost = (page: Page) => page.evaluate(() => (window as unknown as { lab: { lost: string } }).lab.lost);

/** Milliseconds from `began` until the robot stood. */
async function stoppedAfter(began: number): Promise<number> {
  await expect.poll(() => speeds.at(-1)?.speed).toBe(0);
  const after = speeds.at(-1)!.at - began;
  test.info().annotations.push({ type: "ms until the robot stood", description: String(after) });
  return after;
}

test("the robot goes on for as long as the page is alive", async ({ page }) => {
  await drive(page);
  const before = speeds.length;
  await page.waitForTimeout(5 * deadman);
  expect(speeds.length).toBe(before);
  expect(await lost(page)).toBe("");
});

for (const entry of ["index.js", "worker.js"])
  test(`a main thread that hangs stops the robot, with ${entry}`, async ({ page }) => {
    await drive(page, deadman, entry);
    const began = await page.evaluate(() => {
      const now = Date.now();
      while (Date.now() < now + 1000);
      return now;
    });
    expect(await stoppedAfter(began)).toBeLessThan(soon);
    await expect.poll(() => lost(page)).toContain(`its holder has not renewed it for ${deadman} ms`);
    const late = await page.evaluate(async () => {
      const { driven } = (
        window as unknown as { lab: { driven: Record<"Drive", (...way: number[]) => Promise<void>> } }
      ).lab;
      return driven.Drive(50, 32767).catch((error: Error) => error.message);
    });
    expect(late).toContain("has ended");
  });

test("a page that is frozen, by a debugger, stops the robot", async ({ page }) => {
  await drive(page);
  const browser = await page.context().newCDPSession(page);
  await browser.send("Debugger.enable");
  const paused = new Promise((resolve) => browser.once("Debugger.paused", () => resolve(null)));
  await browser.send("Debugger.pause");
  await paused; // at the next timer: a renewal
  expect(await stoppedAfter(Date.now())).toBeLessThan(soon);
  await browser.send("Debugger.resume");
});

test("a page that is hidden stops the robot, and hears so when it is looked at again", async ({ page }) => {
  await drive(page);
  const show = (state: string) =>
    page.evaluate((wanted) => {
      Object.defineProperty(document, "visibilityState", { configurable: true, get: () => wanted });
      return Date.now();
    }, state);
  const began = await show("hidden");
  expect(await stoppedAfter(began)).toBeLessThan(soon);
  expect(await lost(page)).toBe("");
  await show("visible");
  await expect.poll(() => lost(page)).toContain("has ended");
});

test("a page that is closed stops the robot", async ({ page }) => {
  await drive(page, 60_000);
  const began = Date.now();
  await page.close();
  expect(await stoppedAfter(began)).toBeLessThan(soon);
});

test("the robot is the other page's at once that takes the lease over", async ({ page, context }) => {
  await drive(page, 5000);
  const other = await context.newPage();
  await other.goto(gateway.url);
  const refused = await other.evaluate(async () => {
    const { connect, lease } = await import(new URL("index.js", location.href).href);
    const driven = await connect("/devices/create?service=Create");
    const refusals = [driven.Drive(10, 32767), lease(driven)].map((each: Promise<unknown>) =>
      each.then(() => "").catch((error: Error) => error.name),
    );
    const texts = await Promise.all(refusals);
    await lease(driven, { deadman: 5000, takeover: true });
    await driven.$.urgent.Drive(10, 32767);
    return texts;
  });
  expect(refused).toEqual(["RobotRaconteur.ObjectLockedError", "RobotRaconteur.ObjectLockedError"]);
  await expect.poll(() => lost(page)).toContain("it was taken over by another client");
  await expect.poll(() => speeds.at(-1)?.speed).toBeCloseTo(0.01);
  await other.close();
});
