// The client in a worker of its own: what a page whose main thread is busy still gets, told by the device, whose pipe sends no
// image while two are not acknowledged; and what it gets without a copy. Beside it the client in the page itself.
import { cpSync, mkdtempSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";
import { expect, test } from "@playwright/test";
import type { Page } from "@playwright/test";
import type { Losses } from "../../../wasm-client/dist/index.js";
import { Program, repositoryRoot, rrgate, startGateway, startTestService } from "../processes";

/** Tells the page of each large array that the worker hands over: its size then, and what the worker has left of it. */
const spy = `
const post = MessagePort.prototype.postMessage;
const channel = new BroadcastChannel("transfers");
MessagePort.prototype.postMessage = function (message, transfer = []) {
  const buffers = [...transfer].filter((each) => each.byteLength > 1_000_000);
  const sizes = buffers.map((each) => each.byteLength);
  post.call(this, message, transfer);
  for (const [i, buffer] of buffers.entries()) channel.postMessage([sizes[i], buffer.byteLength]);
};
`;

/** A folder for a gateway to serve: the package as it is published, and an empty page. */
function makeSite(): string {
  const site = mkdtempSync(path.join(tmpdir(), "rrgate-site-"));
  cpSync(path.join(repositoryRoot, "wasm-client/dist"), site, { recursive: true });
  writeFileSync(path.join(site, "index.html"), "<!doctype html><title>worker</title>");
  writeFileSync(path.join(site, "spy.js"), spy);
  writeFileSync(path.join(site, "spied.js"), 'import "./spy.js";\nimport "./worker_thread.js";\n');
  return site;
}

const device = new Program(path.join(path.dirname(rrgate), "../test/load/browser_device"), []);
let gateway: Awaited<ReturnType<typeof startGateway>>;
let big: Awaited<ReturnType<typeof startTestService>>;

test.beforeAll(async () => {
  device.start();
  const { 1: port } = await device.waitForOutput(/"port":(\d+)/);
  const url = `rr+tcp://127.0.0.1:${port}/?service=Panels`;
  const devices = [
    { name: "panels", url },
    { name: "shared", url, mode: "shared" },
  ];
  gateway = await startGateway("panels", "", makeSite(), { devices });
  big = await startTestService(makeSite());
});

test.afterAll(async () => {
  await gateway?.program.kill("SIGTERM");
  await device.kill("SIGTERM");
  await big?.stop();
});

/**
 * Follows the images, whose first byte counts those that the device has made, while the main thread is busy for half a second.
 * @returns the steps from each to the next.
 */
async function stepsWhileBusy(page: Page, entry: string): Promise<number[]> {
  await page.goto(gateway.url);
  return page.evaluate(async (script) => {
    const { connect } = await import(new URL(script, location.href).href);
    const panels = await connect("/devices/panels?service=Panels");
    const images = await panels.images.connect();
    const seen: number[] = [];
    let busyAt = Infinity;
    for await (const { data } of images) {
      seen.push(data[0] as number);
      if (seen.length === 15) {
        busyAt = performance.now();
        while (performance.now() < busyAt + 500);
      }
      if (performance.now() > busyAt + 1000) break;
    }
    await panels.$.close();
    return seen.slice(1).map((count, i) => (count - seen[i]! + 256) % 256);
  }, entry);
}

test("a page that is busy for half a second misses nothing", async ({ page }) => {
  const without = Math.max(...(await stepsWhileBusy(page, "index.js")));
  const steps = await stepsWhileBusy(page, "worker.js");
  test
    .info()
    .annotations.push({ type: "most images missed, in a row", description: `${without}, ${Math.max(...steps)}` });
  // 15 are made meanwhile; a machine that has other work makes fewer.
  expect(without).toBeGreaterThan(6);
  expect(Math.max(...steps)).toBeLessThan(without / 2);
  expect(steps.reduce((sum, step) => sum + step)).toBeGreaterThan(25); // it is followed until it is up to date again
});

test("a wire has the newest value after it, and losses tell how many that replaced", async ({ page }) => {
  await page.goto(gateway.url);
  const seen = await page.evaluate(async () => {
    const { connect } = await import(new URL("worker.js", location.href).href);
    const panels = await connect("/devices/shared?service=Panels"); // whose gateway keeps an account
    const wire = panels.w0.connect();
    const times: number[] = [];
    const losses: unknown[] = [];
    let freeAt = Infinity;
    for await (const _ of wire) {
      times.push(performance.now());
      if (times.length === 10) {
        losses.push(await wire.losses());
        freeAt = performance.now() + 500;
        while (performance.now() < freeAt);
      }
      if (performance.now() < freeAt + 100) continue;
      losses.push(await wire.losses());
      break;
    }
    await panels.$.close();
    return { losses, atOnce: times.filter((at) => at >= freeAt && at < freeAt + 8).length };
  });
  const [before, after] = seen.losses as [Losses, Losses];
  test.info().annotations.push({ type: "values replaced", description: `${before.conflated}, ${after.conflated}` });
  expect(after.conflated - before.conflated).toBeGreaterThan(10); // 50 are sent meanwhile
  expect(after.delivered).toBeGreaterThan(before.delivered);
  expect(seen.atOnce).toBeLessThan(10); // what was on its way, and the newest
});

test("7 MB of doubles are handed over, not copied", async ({ page }) => {
  await page.goto(big.url);
  const seen = await page.evaluate(async () => {
    const { connect, init } = await import(new URL("worker.js", location.href).href);
    const transfers: number[][] = [];
    new BroadcastChannel("transfers").onmessage = ({ data }) => transfers.push(data as number[]);
    init({ worker: () => new Worker("spied.js", { type: "module" }) });
    const device = await connect("/devices/big?service=interop");
    const ramp: Float64Array = await device.ramp(875_000);
    const sum: number = await device.sum(ramp);
    while (transfers.length === 0) await new Promise((resolve) => setTimeout(resolve, 5));
    await device.$.close();
    return { kind: ramp.constructor.name, bytes: ramp.byteLength, last: ramp.at(-1), sum, transfers };
  });
  expect(seen).toEqual({
    kind: "Float64Array",
    bytes: 7_000_000,
    last: 874_999,
    sum: (875_000 * 874_999) / 2,
    transfers: [[7_000_000, 0]],
  });
});
