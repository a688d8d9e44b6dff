// The conference room of the examples: its board, the page at its wall, and a phone that is one of its sensors.
import { cpSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";
import { expect, test } from "@playwright/test";
import launch from "../chromium.json" with { type: "json" };
import { Program, deviceProgram, freePort, repositoryRoot, rrgate } from "../processes";

const camera = ["--use-fake-device-for-media-stream", "--use-fake-ui-for-media-stream"];
test.use({ launchOptions: { ...launch, args: [...launch.args, ...camera] } });

interface Colour {
  red: number;
  green: number;
  blue: number;
}

const read = async <T>(url: string): Promise<T> => (await (await fetch(url)).json()) as T;

test("the board sets a target, which the light reaches, and plots it", async ({ page }) => {
  const demo = new Program(rrgate, ["demo", "conference-room", "--port", "0", "--no-browser"]);
  demo.start();
  try {
    const [, url] = await demo.waitForOutput(/rrgate demo: (http:\/\/127\S+)/);
    await page.goto(`${url}#/devices/controller/Controller`);
    await expect(page.locator("[data-panel]")).toHaveCount(6);
    for (const name of ["Northern sensors", "Southern sensors", "Lights"])
      await expect(page.getByRole("group", { name })).toContainText(/\d/);
    for (const name of ["Mean of the sensors", "Error"])
      await expect(page.getByRole("group", { name }).locator("canvas").first()).toBeVisible();
    const target = page.getByRole("group", { name: "Target" });
    await target.getByLabel("red").first().fill("300");
    await target.getByLabel("green").first().fill("250");
    await target.getByLabel("blue").first().fill("200");
    await target.getByRole("button", { name: "Set target" }).click();
    const member = (name: string): string => `${url}api/v1/devices/controller/Controller/${name}`;
    await expect.poll(() => read<Colour>(member("target"))).toEqual({ red: 300, green: 250, blue: 200 });
    await expect.poll(async () => Math.abs((await read<Colour>(member("mean"))).red - 300)).toBeLessThan(15);
  } finally {
    await demo.kill("SIGTERM");
  }
});

test.describe("at the wall", () => {
  let folder: string;
  let room: Program;
  let gateway: Program;
  let url: string;

  test.beforeAll(async () => {
    folder = mkdtempSync(path.join(tmpdir(), "rrgate-room-"));
    const example = path.join(repositoryRoot, "examples/conference-room");
    cpSync(path.join(example, "site"), path.join(folder, "site"), { recursive: true });
    cpSync(
      path.join(example, "experimental.conference_room.robdef"),
      path.join(folder, "site/experimental.conference_room.robdef"),
    );
    cpSync(path.join(repositoryRoot, "examples/phone/site/sign_in.js"), path.join(folder, "site/sign_in.js"));
    cpSync(path.join(repositoryRoot, "wasm-client/dist"), path.join(folder, "site/rrgate-client"), { recursive: true });
    const port = await freePort();
    url = `http://127.0.0.1:${port}/`;
    let config = readFileSync(path.join(example, "gateway.json"), "utf8").replace(
      "127.0.0.1:8080",
      `127.0.0.1:${port}`,
    );
    const ports: string[] = [];
    for (const given of ["52231", "52232", "52233", "52234"]) {
      ports.push("--port", String(await freePort()));
      config = config.replace(given, ports.at(-1) ?? "");
    }
    writeFileSync(path.join(folder, "gateway.json"), config);
    const phone = `rr+ws://127.0.0.1:${port}/devices/sensors-phone?service=Sensors`;
    room = new Program(deviceProgram("rrgate-demo-conference-room"), [...ports, "--sensors", phone]);
    gateway = new Program(rrgate, ["serve", "--config", path.join(folder, "gateway.json")]);
    for (const program of [room, gateway]) program.start();
    await gateway.waitForOutput(/listening/);
  });

  test.afterAll(async () => {
    await gateway?.kill("SIGTERM");
    await room?.kill("SIGTERM");
    rmSync(folder, { recursive: true, force: true });
  });

  const member = (device: string, name: string): string => `${url}api/v1/devices/${device}/${name}`;

  test("sliders set the light, and the page shows lights, sensors and what they measured", async ({ page }) => {
    const complaints: string[] = [];
    page.on("pageerror", (error) => complaints.push(String(error)));
    await page.goto(url);
    await expect(page.locator("p[role=status]")).toHaveText("connected");
    await page.getByLabel("Red").fill("450");
    await page.getByLabel("Green").fill("150");
    await page.getByLabel("Blue").fill("150");
    const target = { red: 450, green: 150, blue: 150 };
    await expect.poll(() => read<Colour>(member("controller", "Controller/target"))).toEqual(target);
    await expect(page.getByText("450 lx")).toBeVisible();
    // A light has become red on the plan, as in the room; and the plots are no longer empty.
    const dot = (x: number, y: number): Promise<number[]> =>
      page
        .locator("#plan")
        .evaluate(
          (canvas, [x, y]) =>
            Array.from((canvas as HTMLCanvasElement).getContext("2d")?.getImageData(x ?? 0, y ?? 0, 1, 1).data ?? []),
          [x, y],
        );
    await expect
      .poll(async () => {
        const [red = 0, green = 0] = await dot(80, 120);
        return red > 2 * green && red > 60;
      })
      .toBe(true);
    for (const plot of ["#mean", "#error"])
      await expect
        .poll(() =>
          page.locator(plot).evaluate((canvas) =>
            (canvas as HTMLCanvasElement)
              .getContext("2d")
              ?.getImageData(320, 0, 320, 100)
              .data.some((byte) => byte > 0),
          ),
        )
        .toBe(true);
    await page.getByLabel("The controller is on").uncheck();
    await expect.poll(() => read<boolean>(member("controller", "Controller/on"))).toBe(false);
    await page.getByLabel("The controller is on").check();
    await expect.poll(() => read<boolean>(member("controller", "Controller/on"))).toBe(true);
    expect(complaints).toEqual([]);
  });

  test("a phone is one more sensor for as long as its page is open", async ({ page }) => {
    test.setTimeout(120_000);
    const mean = (): Promise<Colour> => read<Colour>(member("controller", "Controller/mean"));
    await fetch(member("controller", "Controller/on"), {
      method: "PUT",
      headers: { "Content-Type": "application/json" },
      body: "false",
    });
    let alone = -1;
    await expect.poll(async () => alone === (alone = (await mean()).green), { intervals: [500] }).toBe(true);
    await page.goto(`${url}phone.html?x=2&y=5`);
    await page.getByLabel("White is").fill("2000");
    await page.getByRole("button", { name: "Measure" }).click();
    await expect(page.locator("p[role=status]")).toHaveText("measuring");
    await expect.poll(() => read<unknown>(member("sensors-phone", "Sensors/places"))).toEqual([{ x: 2, y: 5 }]);
    const green = async (): Promise<number> =>
      (await read<Partial<Colour>[]>(member("sensors-phone", "Sensors/readings")))[0]?.green ?? 0;
    await expect.poll(green).toBeGreaterThan(100);
    // The controller looks for a sensor that it has missed for long every 30 s.
    await expect.poll(async () => Math.abs((await mean()).green - alone), { timeout: 45_000 }).toBeGreaterThan(5);
    await page.close();
    await expect.poll(async () => Math.abs((await mean()).green - alone), { timeout: 30_000 }).toBeLessThan(0.01);
  });
});
