// Processes of the demo systems that are killed and started again at random while a page is open: the page shows live values afterwards.
// RESTARTS_SECONDS makes each round longer, with all systems (./dev soak); RESTARTS_SEED repeats what another run did.
import { readFileSync, readdirSync } from "node:fs";
import { connect } from "node:net";
import path from "node:path";
import { expect, test } from "@playwright/test";
import type { Page } from "@playwright/test";
import { Program, repositoryRoot, rrgate } from "../processes";

const long = process.env["RESTARTS_SECONDS"];
const seconds = Number(long ?? 10);
const seed = Number(process.env["RESTARTS_SEED"] ?? Date.now() % 1_000_000);
const python = process.env["RRGATE_PYTHON"] ?? path.join(repositoryRoot, "build/deps/venv/bin/python");

interface System {
  name: string;
  options?: readonly string[];
  /** How many processes it has. */
  processes: number;
  /** The page that is open: of a device, and of one of its services. */
  page: string;
  /** What moves it, by another amount each time; left out: it moves by itself. */
  move?: (call: Call, by: number) => Promise<boolean>;
  /** What is seen to change where it moves: text or a picture. */
  shown: readonly string[];
  /** Also restarted for a short time. */
  isShort?: boolean;
  /** How long it may take to listen again, in seconds. */
  listensWithin?: number;
}

/** Of a member of the page's object. */
type Call = (member: string, parameters: object) => Promise<boolean>;

const tables = '[data-panel="table"]';
const pictures = '[data-panel="image"] canvas';
const drive = (call: Call, by: number): Promise<boolean> =>
  call("Drive", { velocity: Math.round(by * 400), radius: 32767 });

const systems: readonly System[] = [
  {
    name: "create",
    processes: 2,
    page: "create/Create?view=board",
    move: drive,
    shown: [tables, pictures],
    isShort: true,
  },
  {
    name: "create-minimal",
    processes: 1,
    page: "create/Create?view=board",
    move: async (call, by) => (await call("StartStreaming", {})) && drive(call, by),
    shown: [tables],
  },
  { name: "robots", processes: 6, page: "robot-1/Create?view=board", move: drive, shown: [tables] },
  { name: "fleet", options: ["--count", "20"], processes: 1, page: "sensor-7/Sensor", shown: [tables] },
  { name: "webcams", options: ["--device", "none"], processes: 1, page: "webcams/Webcam", shown: [pictures] },
  {
    name: "conference-room",
    processes: 1,
    page: "controller/Controller",
    move: (call, by) => call("target", { red: 200 + 300 * by, green: 300, blue: 300 }),
    shown: [tables],
  },
  {
    name: "microassembly",
    processes: 4,
    page: "cell/Cell",
    move: (call, by) => call("move", { probe: 2, by: [by, 0, 0, 0.5] }),
    shown: [tables, pictures],
    isShort: true,
  },
  {
    name: "baxter",
    processes: 1,
    page: "baxter/base",
    move: (call, by) => call("drive", { speed: by, turn: 0.2 }),
    shown: [tables],
    listensWithin: 90, // its library waits until connections of the process before are forgotten
  },
];

/** Below 1, the same for the same seed. */
function makeRandom(state: number): () => number {
  return () => {
    state = (Math.imul(state, 1_664_525) + 1_013_904_223) >>> 0;
    return state / 2 ** 32;
  };
}

/** Command lines of the processes that another one has started. */
function childrenOf(parent: number): { pid: number; words: string[] }[] {
  return readdirSync("/proc")
    .filter((name) => /^\d+$/.test(name))
    .flatMap((name) => {
      try {
        const status = readFileSync(`/proc/${name}/stat`, "utf8");
        if (Number(status.slice(status.lastIndexOf(")") + 2).split(" ")[1]) !== parent) return [];
        return [{ pid: Number(name), words: readFileSync(`/proc/${name}/cmdline`, "utf8").split("\0").slice(0, -1) }];
      } catch {
        return []; // it has ended
      }
    });
}

const pause = (ms: number): Promise<void> => new Promise((resolve) => setTimeout(resolve, ms));

function isListening(port: number): Promise<boolean> {
  return new Promise((resolve) => {
    const socket = connect(port, "127.0.0.1");
    socket.once("connect", () => resolve(true)).once("error", () => resolve(false));
    socket.once("connect", () => socket.destroy());
  });
}

/** A process of a system, with the ports that it is to listen on. */
class Part {
  readonly #program: Program;
  readonly #ports: readonly number[];

  constructor(words: readonly string[], environment: Readonly<Record<string, string>>) {
    this.#program = new Program(words[0] ?? "", words.slice(1), environment);
    // Of a range, as the fleet's, the first port stands for all.
    this.#ports = words.flatMap((word, i) => (words[i - 1] === "--port" ? [Number.parseInt(word)] : []));
  }

  start(): void {
    this.#program.start();
  }

  kill(signal: NodeJS.Signals = "SIGKILL"): Promise<void> {
    return this.#program.kill(signal);
  }

  /** A process that it has started may hold a port a moment longer. */
  async untilFree(): Promise<void> {
    for (const port of this.#ports) await expect.poll(() => isListening(port)).toBe(false);
  }
}

/** What the page shows now, each part of it. */
function look(page: Page, shown: readonly string[]): Promise<string[]> {
  const text = (all: (HTMLElement | SVGElement)[]): string =>
    all.map((each) => (each instanceof HTMLCanvasElement ? each.toDataURL() : each.textContent)).join("\n");
  return Promise.all(shown.map((selector) => page.locator(selector).evaluateAll(text)));
}

/** The streams of cameras that have restarted rest until somebody starts them. */
async function startStreams(page: Page): Promise<void> {
  const buttons = page.getByRole("button", { name: "Start stream" });
  await buttons.evaluateAll((all) => (all as HTMLButtonElement[]).forEach((button) => button.click()));
}

for (const system of systems.filter(({ isShort }) => long !== undefined || isShort))
  test(`the page of ${system.name} outlives its processes`, async ({ page }) => {
    console.log(`seed ${seed}`);
    const listensWithin = system.listensWithin ?? 0;
    test.setTimeout((seconds + listensWithin + 180) * 1000);
    const random = makeRandom(seed);
    const complaints: string[] = [];
    page.on("pageerror", (error) => complaints.push(String(error)));
    const environment = { ["PATH"]: `${path.dirname(python)}:${process.env["PATH"]}` }; // baxter's
    const words = ["demo", system.name, ...(system.options ?? []), "--port", "0", "--no-browser"];
    const demo = new Program(rrgate, words, environment);
    demo.start();
    let parts: Part[] = [];
    try {
      const [, url] = await demo.waitForOutput(/rrgate demo: (http:\/\/127\S+)/, 60_000);
      await page.goto(`${url}#/devices/${system.page}`);
      await expect(page.locator('[data-link="online"]')).toBeVisible();

      // They are this test's from here on: the demo starts none again.
      const children = childrenOf(demo.pid ?? 0);
      expect(children.length).toBe(system.processes);
      for (const { pid } of children) process.kill(pid, "SIGKILL");
      await expect.poll(() => childrenOf(demo.pid ?? 0).length).toBe(0);
      parts = children.map((child) => new Part(child.words, environment));
      for (const part of parts) await part.untilFree();
      for (const part of parts) part.start();

      const end = Date.now() + seconds * 1000;
      let restarts = 0;
      for (; Date.now() < end; restarts++) {
        const part = parts[Math.floor(random() * parts.length)];
        await part?.kill(random() < 0.7 ? "SIGKILL" : "SIGTERM");
        await part?.untilFree();
        await pause(random() * 1500);
        part?.start();
        await pause(random() * 1500);
      }
      expect(restarts).toBeGreaterThan(seconds / 5);

      // Nothing is loaded again: what is shown now, the open page has found by itself.
      const call: Call = async (member, parameters) => {
        const answer = await fetch(`${url}api/v1/devices/${system.page.split("?")[0]}/${member}`, {
          method: member === "target" ? "PUT" : "POST",
          headers: { "Content-Type": "application/json" },
          body: JSON.stringify(parameters),
        });
        return answer.ok;
      };
      const offline = async (): Promise<string[]> => {
        const { devices } = (await (await fetch(`${url}api/v1/devices`)).json()) as {
          devices: { name: string; state: string }[];
        };
        return devices.filter(({ state }) => state !== "online").map(({ name }) => name);
      };
      await expect.poll(offline, { timeout: (30 + listensWithin) * 1000 }).toEqual([]);
      await expect.poll(() => look(page, system.shown), { timeout: 30_000 }).not.toContain("");
      for (const by of [0.5, -0.25]) {
        const before = await look(page, system.shown);
        const moved = async (): Promise<boolean> => (await system.move?.(call, by)) ?? true;
        await expect.poll(moved, { timeout: 30_000 }).toBe(true);
        const changed = async (): Promise<boolean[]> => {
          await startStreams(page);
          return (await look(page, system.shown)).map((text, i) => text !== before[i]);
        };
        await expect.poll(changed, { timeout: 30_000 }).toEqual(before.map(() => true));
      }
      await expect(page.locator('[data-link="online"]')).toBeVisible();
      await expect(page.locator(".board .failure").filter({ hasText: /\S/ })).toHaveCount(0);
      expect(complaints).toEqual([]);
    } finally {
      for (const part of parts) await part.kill();
      await demo.kill("SIGTERM");
    }
  });
