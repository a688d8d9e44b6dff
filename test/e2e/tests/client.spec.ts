// The client package in a page and in a worker, without a bundler: through device, gateway and browser.
import { cpSync, mkdtempSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";
import { expect, test } from "@playwright/test";
import { repositoryRoot, startTestService } from "../processes";

const worker = `
import { connect } from "./index.js";
const robot = await connect(new URL("/devices/big?service=interop", location));
postMessage(await robot.add(2, 3));
for await (const number of robot.count_up(1, 3)) postMessage(number);
await robot.$.close();
postMessage(robot.$.state);
`;

/** A folder for the gateway to serve: the package as it is published, an empty page and a worker. */
function makeSite(): string {
  const site = mkdtempSync(path.join(tmpdir(), "rrgate-site-"));
  cpSync(path.join(repositoryRoot, "wasm-client/dist"), site, { recursive: true });
  writeFileSync(path.join(site, "index.html"), "<!doctype html><title>client</title>");
  writeFileSync(path.join(site, "worker.js"), worker);
  return site;
}

let gateway: Awaited<ReturnType<typeof startTestService>>;

test.beforeAll(async () => {
  gateway = await startTestService(makeSite());
});

test.afterAll(() => gateway?.stop());

test("10 MiB of doubles cross device, gateway and browser unharmed; more than the limit fails alone", async ({
  page,
}) => {
  await page.goto(gateway.url);
  const seen = await page.evaluate(async () => {
    const count = 1_310_720; // doubles in 10 MiB
    const { connect } = await import(new URL("index.js", location.href).href);
    const url = `ws://${location.host}/devices/big?service=interop`;
    const big = await connect(url);
    const other = await connect(url);
    const ramp: Float64Array = await big.ramp(count);
    const wrong = ramp.findIndex((value, index) => value !== index);
    const sum: number = await big.sum(ramp);
    const tooMuch: string = await big.sum(new Float64Array(2 * count)).then(
      () => "accepted",
      (error: { code: number }) => `refused with ${error.code}`,
    );
    const after: number = await other.add(2, 3);
    return { kind: ramp.constructor.name, length: ramp.length, wrong, sum, tooMuch, after };
  });
  expect(seen).toEqual({
    kind: "Float64Array",
    length: 1_310_720,
    wrong: -1,
    sum: (1_310_720 * 1_310_719) / 2,
    tooMuch: "refused with 27",
    after: 5,
  });
});

test("a worker is as good as a page", async ({ page }) => {
  await page.goto(gateway.url);
  const said = await page.evaluate(
    () =>
      new Promise((resolve, reject) => {
        const said: unknown[] = [];
        const worker = new Worker("worker.js", { type: "module" });
        worker.onerror = (error) => reject(new Error(error.message));
        worker.onmessage = ({ data }) => said.push(data) === 5 && resolve(said);
      }),
  );
  expect(said).toEqual([5, 1, 2, 3, "closed"]);
});
