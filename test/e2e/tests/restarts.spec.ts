// Nodes of an example that are killed and started again at random while its page is open: the page shows live values afterwards.
// RESTARTS_SECONDS makes it longer (./dev soak), RESTARTS_SEED repeats what another run did.
import { readFileSync, readdirSync } from "node:fs";
import { expect, test } from "@playwright/test";
import { Program, rrgate } from "../processes";

const seconds = Number(process.env["RESTARTS_SECONDS"] ?? 30);
const seed = Number(process.env["RESTARTS_SEED"] ?? Date.now() % 1_000_000);

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

test("the page of the microassembly cell outlives its nodes", async ({ page }) => {
  console.log(`seed ${seed}`);
  test.setTimeout((seconds + 120) * 1000);
  const random = makeRandom(seed);
  const complaints: string[] = [];
  page.on("pageerror", (error) => complaints.push(String(error)));
  const demo = new Program(rrgate, ["demo", "microassembly", "--port", "0", "--no-browser"]);
  demo.start();
  let parts: Program[] = [];
  try {
    const [, url] = await demo.waitForOutput(/rrgate demo: (http:\/\/127\S+)/);
    await page.goto(`${url}#/devices/cell/Cell`);
    const pictures = page.locator('[data-panel="image"] canvas');
    await expect(pictures).toHaveCount(4);

    // They are this test's from here on: the demo starts none again.
    const children = childrenOf(demo.pid ?? 0);
    expect(children.map(({ words }) => words[1]).sort()).toEqual(["cameras", "cell", "illuminators", "stages"]);
    for (const { pid } of children) process.kill(pid, "SIGKILL");
    await expect.poll(() => childrenOf(demo.pid ?? 0).length).toBe(0); // each holds its port until then
    parts = children.map(({ words }) => new Program(words[0] ?? "", words.slice(1)));
    for (const part of parts) part.start();

    const end = Date.now() + seconds * 1000;
    let restarts = 0;
    for (; Date.now() < end; restarts++) {
      const part = parts[Math.floor(random() * parts.length)];
      await part?.kill(random() < 0.7 ? "SIGKILL" : "SIGTERM");
      await pause(random() * 1500);
      part?.start();
      await pause(random() * 1500);
    }
    expect(restarts).toBeGreaterThan(seconds / 5);

    // Nothing is loaded again: what is shown now, the open page has found by itself.
    const look = (): Promise<string[]> =>
      pictures.evaluateAll((all) => all.map((canvas) => (canvas as HTMLCanvasElement).toDataURL()));
    const move = async (by: number): Promise<boolean> => {
      const answer = await fetch(`${url}api/v1/devices/cell/Cell/move`, {
        method: "POST",
        headers: { "Content-Type": "application/json" },
        body: JSON.stringify({ probe: 2, by: [by, 0, 0, 0.5] }),
      });
      return answer.ok;
    };
    const before = await look();
    await expect.poll(() => move(0.5), { timeout: 30_000 }).toBe(true);
    await expect
      .poll(async () => (await look()).filter((picture, i) => picture !== before[i]).length, { timeout: 30_000 })
      .toBeGreaterThan(0);
    const poses = page.getByRole("group", { name: "poses" }).first();
    const shown = await poses.innerText();
    await expect.poll(() => move(-0.25), { timeout: 30_000 }).toBe(true);
    await expect.poll(() => poses.innerText(), { timeout: 30_000 }).not.toBe(shown);
    await expect(page.locator('[data-link="online"]')).toBeVisible();
    await expect(page.locator(".board .failure").filter({ hasText: /\S/ })).toHaveCount(0);
    expect(complaints).toEqual([]);
  } finally {
    for (const part of parts) await part.kill();
    await demo.kill("SIGTERM");
  }
});
