// A board that stays open for a day: plot, image and log are fed with its packets as fast as the page takes them, and its memory
// stays where it was. DAY_SECONDS is how much of the day (./dev soak: all of it).
import { expect, test } from "@playwright/test";
import type { CDPSession } from "@playwright/test";
import type { Panel } from "../../../web/src/board/board";
import { serve } from "../../../wasm-client/dist/serve/node.js";
import { Program, freePort, rrgate, webRoot } from "../processes";
import { mkdtempSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";

const seconds = Number(process.env["DAY_SECONDS"] ?? 9_000);
const NUMBERS = 10; // of each second
/** The gateway has room for them where the page is slow: it takes what was sent before more is. */
const AT_ONCE_S = 100;
/** Then the plot has what it keeps, 25,000 at most. */
const FULL_S = 3_000;
const MOST_GROWTH = 1_000_000;

test.use({ trace: "off" }); // it keeps what the page had

const definition = `
service example.day
stdver 0.10
struct Picture
    field uint32 width
    field uint32 height
    field uint8[] data
end
object Watch
    pipe double[4] numbers [readonly]
    pipe Picture pictures [readonly]
    event passed(double second)
end`;

/** Bytes of the page that are in use: of objects, and of buffers as those of WebAssembly. */
async function heapOf(page: CDPSession): Promise<number> {
  await page.send("HeapProfiler.collectGarbage");
  const { usedSize, backingStorageSize = 0 } = (await page.send("Runtime.getHeapUsage")) as Record<string, number>;
  return (usedSize ?? NaN) + backingStorageSize;
}

test(`the memory of a board does not grow in ${seconds} seconds of packets`, async ({ page }) => {
  test.setTimeout(60_000 + seconds * 20);
  const port = await freePort();
  const url = `http://127.0.0.1:${port}/`;
  const config = path.join(mkdtempSync(path.join(tmpdir(), "rrgate-day-")), "gateway.json");
  writeFileSync(config, JSON.stringify({ listen: [`127.0.0.1:${port}`], web_root: webRoot, devices: [], serve: {} }));
  const gateway = new Program(rrgate, ["serve", "--config", config]);
  gateway.start();
  await gateway.waitForOutput(/listening/);
  const device = await serve({ url, name: "day", definition, type: "example.day.Watch", object: {} });
  try {
    const at = { title: "", from: "", object: "", w: 4, h: 8, y: 0 };
    const panels: Omit<Panel, "id">[] = [
      { ...at, x: 0, kind: "plot", settings: { member: "numbers" } },
      { ...at, x: 4, kind: "image", settings: { member: "pictures" } },
      { ...at, x: 8, kind: "log", settings: {} },
    ];
    const board = Buffer.from(JSON.stringify({ board: 1, panels })).toString("base64url");
    await page.goto(`${url}#/devices/day/Watch?view=board&board=${board}`);
    const numbers = device.root.pipe("numbers");
    const pictures = device.root.pipe("pictures");
    await expect.poll(() => [numbers.endpoints.size, pictures.endpoints.size]).toEqual([1, 1]);
    const devtools = await page.context().newCDPSession(page);

    const data = new Uint8Array(64 * 48 * 3);
    let second = 0;
    const live = async (until: number): Promise<number> => {
      while (second < until) {
        const sent: Promise<unknown>[] = [];
        for (let i = 0; i < AT_ONCE_S; ++i, ++second) {
          for (let k = 0; k < NUMBERS; ++k) sent.push(numbers.send(Float64Array.of(second, k, Math.random(), -second)));
          sent.push(pictures.send({ width: 64, height: 48, data: data.fill(second % 256) }));
          device.emit("passed", second);
        }
        await Promise.all(sent);
        await page.waitForFunction(
          (last) => document.querySelector('[data-panel="log"] li')?.textContent.endsWith(` ${last}`),
          second - 1,
        );
      }
      return heapOf(devtools);
    };
    const heaps: number[] = [];
    while (second < seconds) heaps.push(await live(second + FULL_S));
    console.log(heaps.join(" "));
    const full = Math.min(...heaps.slice(0, 2));
    // What is on its way at the moment comes and goes.
    await expect.poll(() => heapOf(devtools)).toBeLessThan(full + MOST_GROWTH);
  } finally {
    await device.close();
    await gateway.kill("SIGTERM");
  }
});
