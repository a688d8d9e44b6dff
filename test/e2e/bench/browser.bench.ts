// Connecting, calls, large values, a board that is full, and stops, in each engine. Rows go to the file that ROWS names.
import { cpSync, mkdtempSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";
import { expect, test } from "@playwright/test";
import type { Panel } from "../../../web/src/board/board";
import type * as Client from "../../../wasm-client/dist/index.js";
import { startChromium } from "../engine";
import type { EngineName } from "../engine";
import { startFirefox } from "../firefox";
import { Program, repositoryRoot, rrgate, startGateway, webRoot } from "../processes";
import { Visitor } from "../visitor";
import { startWebkit } from "../webkit";

const COLD_LOADS = 20;
const CALLS = 2_000;
const LARGE_VALUES = 100;
const WATCHED_S = 10;
const STOPS = 100;

/** As rows.py has them. */
interface Row {
  text: string;
  ours: number;
  unit: string;
  promise?: number;
}

const rows: Row[] = [];
const device = new Program(path.join(path.dirname(rrgate), "../test/load/browser_device"), []);
/** The client alone, under an address of its own for each cold load; the dashboard. */
let client: { program: Program; url: string };
let dashboard: { program: Program; url: string };

test.beforeAll(async () => {
  device.start();
  const { 1: port } = await device.waitForOutput(/"port":(\d+)/);
  const service = (name: string): string => `rr+tcp://127.0.0.1:${port}/?service=${name}`;
  const devices = [
    { name: "panels", url: service("Panels"), mode: "shared" },
    {
      name: "create",
      url: service("Create"),
      mode: "shared",
      leases: { safe: [{ call: "Create.Drive", arguments: [0, 0] }], takeover: ["*"] },
    },
  ];
  client = await startGateway("panels", "", makeSite(), { devices });
  dashboard = await startGateway("panels", "", webRoot, { devices });
});

test.afterAll(async () => {
  for (const program of [client?.program, dashboard?.program, device]) await program?.kill("SIGTERM");
  writeFileSync(process.env["ROWS"] ?? "rows.json", JSON.stringify(rows));
});

function makeSite(): string {
  const site = mkdtempSync(path.join(tmpdir(), "rrgate-bench-"));
  const dist = path.join(repositoryRoot, "wasm-client/dist");
  for (let i = 0; i < 3 * COLD_LOADS; i++) cpSync(dist, path.join(site, `c${i}`), { recursive: true });
  writeFileSync(
    path.join(site, "index.html"),
    '<!doctype html><title>cold</title><script type="module" src="cold.js"></script>',
  );
  writeFileSync(
    path.join(site, "cold.js"),
    `const { connect } = await import("./c" + location.search.slice(1) + "/index.js");
    globalThis.device = await connect(new URL("devices/panels?service=Panels", location));
    for await (const value of device.w0.connect()) {
      globalThis.took = performance.now();
      break;
    }`,
  );
  return site;
}

const ENGINES = [
  ["chromium", startChromium],
  ["firefox", startFirefox],
  ["webkit", startWebkit],
] as const;

for (const [index, [name, start]] of ENGINES.entries()) {
  test(`pages in ${name}`, async () => {
    const engine = await start();
    try {
      const visitor = new Visitor(engine);
      await measureClient(visitor, name, index * COLD_LOADS);
      await measureBoard(visitor, name);
      await measureStops(visitor, name);
      expect(await visitor.complaints()).toEqual([]);
    } finally {
      await engine.close();
    }
  });
}

function tell(engine: EngineName, text: string, ours: number, promise?: number): void {
  rows.push({ text: `${engine}: ${text}`, ours, unit: "ms", ...(promise === undefined ? {} : { promise }) });
}

const part = (times: readonly number[], share: number): number =>
  [...times].sort((a, b) => a - b)[Math.min(times.length - 1, Math.floor(times.length * share))] ?? NaN;

async function measureClient(visitor: Visitor, engine: EngineName, first: number): Promise<void> {
  const cold: number[] = [];
  for (let i = 0; i < COLD_LOADS; i++) {
    await visitor.open(`${client.url}?${first + i}`);
    const took = () => visitor.run(() => (globalThis as { took?: number }).took ?? 0);
    await expect.poll(took, { intervals: [50] }).toBeGreaterThan(0);
    cold.push(await took());
  }
  tell(
    engine,
    `from the address to the first value of a wire, nothing cached, median of ${COLD_LOADS}`,
    part(cold, 0.5),
    300,
  );
  const calls = await time(visitor, "nothing", CALLS);
  tell(engine, "a call of an empty function through the gateway, p50", part(calls, 0.5));
  tell(engine, "the same, p99", part(calls, 0.99));
  tell(engine, "a property of 1 MB (125,000 double), p50", part(await time(visitor, "megabyte", LARGE_VALUES), 0.5));
}

/** Milliseconds of each call of a function, or look at a property. */
async function time(visitor: Visitor, member: string, count: number): Promise<number[]> {
  return visitor.run(
    async (member: string, count: number) => {
      const { device } = globalThis as unknown as { device: Client.RemoteObject };
      const named = device[member]! as unknown as (() => Promise<unknown>) & { get?: () => Promise<unknown> };
      const out: number[] = [];
      for (let i = 0; i < count; i++) {
        const begin = performance.now();
        await (named.get ? named.get() : named());
        out.push(performance.now() - begin);
      }
      return out;
    },
    member,
    count,
  );
}

/** Ten plots of wires of 100 Hz, and an image of 640 x 480 at 30 Hz. */
async function measureBoard(visitor: Visitor, engine: EngineName): Promise<void> {
  const place = { title: "", from: "", object: "" };
  const plots = Array.from({ length: 10 }, (_, i) => {
    const at = { x: (i % 3) * 4, y: Math.floor(i / 3) * 6, w: 4, h: 6 };
    return { ...place, ...at, kind: "plot", settings: { member: `w${i}` } } as const;
  });
  const image = { ...place, x: 4, y: 18, w: 8, h: 10, kind: "image", settings: { member: "images" } } as const;
  const panels: Omit<Panel, "id">[] = [...plots, image];
  const packed = Buffer.from(JSON.stringify({ board: 1, panels })).toString("base64url");
  await visitor.open(`${dashboard.url}#/devices/panels/Panels?view=board&board=${packed}`);
  await visitor.see({ css: '[data-panel="image"] canvas' });
  await new Promise((resolve) => setTimeout(resolve, 3_000));
  const { frames, longest } = await visitor.run(async (seconds: number) => {
    const tasks: number[] = [0];
    new PerformanceObserver((list) => {
      for (const { duration } of list.getEntries()) tasks.push(duration);
    }).observe({ type: "longtask" });
    const ticks = new MessageChannel(); // where the engine tells of no long tasks
    let last = performance.now();
    ticks.port1.onmessage = () => {
      const now = performance.now();
      tasks.push(now - last);
      last = now;
      setTimeout(() => {
        last = performance.now();
        ticks.port2.postMessage(0);
      }, 1);
    };
    ticks.port2.postMessage(0);
    let frames = 0;
    const begin = performance.now();
    const count = (): void => {
      frames++;
      if (performance.now() - begin < seconds * 1_000) requestAnimationFrame(count);
    };
    requestAnimationFrame(count);
    await new Promise((resolve) => setTimeout(resolve, seconds * 1_000));
    return { frames, longest: Math.max(...tasks) };
  }, WATCHED_S);
  tell(
    engine,
    "between two frames of a board with ten wires of 100 Hz and an image of 640 x 480 at 30 Hz",
    (WATCHED_S * 1_000) / frames,
    20,
  );
  tell(engine, `the longest task of that page in ${WATCHED_S} s`, longest, 50);
}

/** A key is let go while another call of the page hangs. When, is known by the clock of page and device. */
async function measureStops(visitor: Visitor, engine: EngineName): Promise<void> {
  await visitor.open(`${dashboard.url}#/devices/create/Create`);
  await visitor.see({ css: "button", name: "Forward" });
  await visitor.run(() => {
    const released: number[] = [];
    Object.assign(globalThis, { released });
    const note = (event: KeyboardEvent): void => void released.push(Date.now() - (performance.now() - event.timeStamp));
    addEventListener("keyup", note, { capture: true });
  });
  for (let i = 0; i < STOPS; i++) {
    const letGo = await visitor.holdKey("ArrowUp");
    await new Promise((resolve) => setTimeout(resolve, 100));
    await letGo();
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
  const released = await visitor.run(() => (globalThis as unknown as { released: number[] }).released);
  const stopped = device.output
    .split("\n")
    .map(Number)
    .filter((each) => each > 1e12);
  expect(released).toHaveLength(STOPS);
  const took = released.map((at) => (stopped.find((each) => each > at - 2) ?? Infinity) - at);
  tell(engine, `from a key that is let go to the device, while a call hangs, p50 of ${STOPS}`, part(took, 0.5));
  tell(engine, "the same, p99", part(took, 0.99), 50);
}
