// The time line of a device that is a replay: of the recording that is kept, behind a gateway as the robot was.
import path from "node:path";
import { expect, test } from "../lab_test";
import { freePort, Program, repositoryRoot, rrgate, startGateway, webRoot } from "../processes";

const file = path.join(repositoryRoot, "test/golden/recordings/create.mcap");

interface State {
  playing: boolean;
  position: number;
  duration: number;
  speed: number;
  loop: boolean;
}

test("a replay is played, paused, set and taken to another time below its panels", async ({ page }) => {
  const replay = new Program(rrgate, [
    "replay",
    file,
    "--paused",
    "--listen",
    `rr+tcp://127.0.0.1:${await freePort()}`,
  ]);
  replay.start();
  const [, url] = await replay.waitForOutput(/rrgate replay: (\S+)/);
  const gateway = await startGateway("create", url ?? "", webRoot);
  const look = async (): Promise<State> =>
    (await (await fetch(`${gateway.url}api/v1/devices/create/replay/state`)).json()) as State;
  try {
    for (const view of ["?view=members", "?view=board"]) {
      await page.goto(`${gateway.url}#/devices/create/Create${view}`);
      await expect(page.getByRole("region", { name: "Replay" })).toBeVisible();
    }
    await page.goto(`${gateway.url}#/devices/create/Create`);
    const bar = page.getByRole("region", { name: "Replay" });
    const time = bar.getByLabel("Time of the recording");
    await expect(bar).toContainText("0:00.0 / 0:05.0");

    await bar.getByLabel("Speed").selectOption("0.25");
    await expect.poll(async () => (await look()).speed).toBe(0.25);
    await bar.getByRole("button", { name: "Play" }).click();
    await expect.poll(async () => Number(await time.inputValue())).toBeGreaterThan(0.2);
    expect(await look()).toMatchObject({ playing: true, loop: false });
    await bar.getByRole("button", { name: "Pause" }).click();
    await expect.poll(async () => (await look()).playing).toBe(false);
    const { position } = await look();
    await expect.poll(async () => Number(await time.inputValue())).toBeCloseTo(position, 6);

    // The page shows the robot where it was at the time that is chosen.
    await expect(page.locator('[data-pose="x"]')).toHaveText("0.000 m");
    await time.fill("4");
    await expect.poll(async () => (await look()).position).toBeCloseTo(4, 1);
    await expect(bar).toContainText("0:04.0 / 0:05.0");
    const recorded = (await (await fetch(`${gateway.url}api/v1/devices/create/Create/state`)).json()) as { x: number };
    expect(recorded.x).toBeGreaterThan(0.3);
    await expect(page.locator('[data-pose="x"]')).toHaveText(`${recorded.x.toFixed(3)} m`);

    // One message after the other, by the keyboard as well.
    const sought = (await look()).position;
    await bar.getByRole("button", { name: "Step" }).click();
    await expect.poll(async () => (await look()).position).toBeGreaterThan(sought);
    const stepped = (await look()).position;
    await page.keyboard.press("Enter");
    await expect.poll(async () => (await look()).position).toBeGreaterThan(stepped);
    expect((await look()).playing).toBe(false);

    await bar.getByLabel("Repeat").click();
    await expect(bar.getByLabel("Repeat")).toBeChecked();
    expect((await look()).loop).toBe(true);
    // What another client does is shown.
    await fetch(`${gateway.url}api/v1/devices/create/replay/seek`, {
      method: "POST",
      headers: { "Content-Type": "application/json" },
      body: JSON.stringify({ position: 1.5 }),
    });
    await expect(bar).toContainText("0:01.5 / 0:05.0");

    // A drag of which Firefox tells no end, as the slider is switched off meanwhile, and one step more after that.
    const drag = (to: string) =>
      time.evaluate(async (slider: HTMLInputElement, value) => {
        slider.value = value;
        slider.dispatchEvent(new Event("input"));
        await new Promise(requestAnimationFrame); // drawn
      }, to);
    await drag("4");
    await expect(bar).toContainText("0:04.0 / 0:05.0");
    await replay.kill();
    await expect(bar.getByRole("button", { name: "Play" })).toBeDisabled();
    await expect(bar).toContainText("0:01.5 / 0:05.0");
    await drag("3");
    await expect(bar).toContainText("0:01.5 / 0:05.0");
    replay.start();
    await expect(bar.getByRole("button", { name: "Play" })).toBeEnabled({ timeout: 30_000 });
    await expect(bar).toContainText("0:00.0 / 0:05.0");
  } finally {
    await gateway.program.kill("SIGTERM");
    await replay.kill("SIGTERM");
  }
});

test("a device that is no replay has no time line", async ({ page, lab }) => {
  await page.goto(`${lab.url}#/devices/create/Create`);
  await expect(page.locator('[data-link="online"]')).toBeVisible();
  await expect(page.getByRole("button", { name: "Forward" })).toBeEnabled();
  await expect(page.getByRole("region", { name: "Replay" })).toHaveCount(0);
});
