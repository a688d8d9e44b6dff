// The example examples/phone: a page that is a device, with the camera of a browser that has an invented one.
import { execFileSync } from "node:child_process";
import { cpSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";
import { expect, test } from "@playwright/test";
import launch from "../chromium.json" with { type: "json" };
import { inEachEngine } from "../engines";
import { password } from "../guarded_lab";
import { Program, freePort, repositoryRoot, rrgate } from "../processes";
import { button } from "../visitor";

const camera = ["--use-fake-device-for-media-stream", "--use-fake-ui-for-media-stream"];
test.use({ launchOptions: { ...launch, args: [...launch.args, ...camera] } });

let folder: string;
let gateway: Program;
let url: string;

test.beforeAll(async () => {
  folder = mkdtempSync(path.join(tmpdir(), "rrgate-phone-"));
  cpSync(path.join(repositoryRoot, "examples/phone"), folder, { recursive: true });
  const client = path.join(repositoryRoot, "wasm-client/dist");
  cpSync(client, path.join(folder, "site/rrgate-client"), { recursive: true });
  const port = await freePort();
  url = `http://127.0.0.1:${port}/`;
  const config = path.join(folder, "gateway.json");
  writeFileSync(config, readFileSync(config, "utf8").replace("127.0.0.1:8080", `127.0.0.1:${port}`));
  gateway = new Program(rrgate, ["serve", "--config", config]);
  gateway.start();
  await gateway.waitForOutput(/listening/);
});

test.afterAll(async () => {
  await gateway?.kill("SIGTERM");
  rmSync(folder, { recursive: true, force: true });
});

const member = (name: string) => `${url}api/v1/devices/phone/Phone/${name}`;
const devices = async () => ((await (await fetch(`${url}api/v1/devices`)).json()) as { devices: unknown[] }).devices;

test("the camera of a page that is a device is a pipe of pictures, which any <img> shows", async ({ page }) => {
  const complaints: string[] = [];
  page.on("pageerror", (error) => complaints.push(String(error)));
  await page.goto(url);
  await page.getByRole("button").click();
  await expect(page.locator("output")).toHaveText('device "phone"');
  await expect.poll(devices).toMatchObject([{ name: "phone", state: "online" }]);
  const stop = new AbortController();
  const pictures = await fetch(`${member("frames")}?as=mjpeg`, { signal: stop.signal });
  expect(pictures.headers.get("content-type")).toContain("multipart/x-mixed-replace");
  const reader = pictures.body!.getReader();
  let head = "";
  while (!head.includes("\r\n\r\n")) head += Buffer.from((await reader.read()).value!).toString("latin1");
  expect(head).toContain("Content-Type: image/jpeg");
  stop.abort();
  await page.close();
  await expect.poll(devices).toEqual([]);
  expect(complaints).toEqual([]);
});

inEachEngine((at) => {
  test("a page is a device with motion and touch, and no more when it is left", async () => {
    const visitor = at();
    await visitor.open(url);
    await visitor.press(button("Be a device"));
    await visitor.see({ css: "output" }, /^device "phone"$/);
    await expect.poll(devices).toMatchObject([{ name: "phone", state: "online", served: true }]);

    const written = await fetch(member("text"), {
      method: "PUT",
      headers: { "Content-Type": "application/json" },
      body: JSON.stringify("für alle"),
    });
    expect(written.status).toBe(204);
    await visitor.see({ css: "q" }, /^für alle$/);

    // What it feels. Not every engine has a DeviceMotionEvent.
    await visitor.run(() => {
      const accelerationIncludingGravity = { x: 1, y: 2, z: 9.5 };
      dispatchEvent(Object.assign(new Event("devicemotion"), { accelerationIncludingGravity }));
    });
    await expect.poll(async () => (await fetch(member("acceleration"))).json()).toEqual([1, 2, 9.5]);

    // What touches it.
    const touches = await fetch(member("touched"), { headers: { Accept: "text/event-stream" } });
    const heard = touches.body!.pipeThrough(new TextDecoderStream()).getReader();
    await visitor.press({ css: "video" });
    let text = "";
    while (!/"y":[\d.]+/.test(text)) text += (await heard.read()).value ?? "";
    expect(text).toMatch(/"x":0\.\d+/);
    await heard.cancel();

    expect(await visitor.complaints()).toEqual([]);
    await visitor.open("about:blank");
    await expect.poll(devices).toEqual([]);
  });
});

test("a page whose camera is denied is a device without pictures", async ({ page }) => {
  await page.addInitScript(() => {
    navigator.mediaDevices.getUserMedia = () => Promise.reject(new DOMException("denied", "NotAllowedError"));
  });
  await page.goto(url);
  await page.getByRole("button", { name: "Be a device" }).click();
  await expect(page.getByText("It has no camera: denied")).toBeVisible();
  await expect(page.locator("output")).toHaveText('device "phone"');
  await expect(page.getByRole("button")).toBeDisabled();
  await expect.poll(devices).toMatchObject([{ name: "phone", state: "online" }]);
  await page.close();
  await expect.poll(devices).toEqual([]);
});

test("where the gateway has users, the page asks who one is", async ({ page }) => {
  const port = await freePort();
  const users = path.join(folder, "users");
  execFileSync(rrgate, ["passwd", users, "vera", "--roles", "staff"], { input: `${password}\n` });
  const config = {
    listen: [`127.0.0.1:${port}`],
    devices: [],
    ["web_root"]: "site",
    serve: {},
    access: { ["users_file"]: users, rules: [{ roles: ["staff"], devices: ["phone"], may: ["serve", "read"] }] },
  };
  const file = path.join(folder, "guarded.json");
  writeFileSync(file, JSON.stringify(config));
  const guarded = new Program(rrgate, ["serve", "--config", file]);
  guarded.start();
  try {
    await guarded.waitForOutput(/listening/);
    await page.goto(`http://127.0.0.1:${port}/`);
    await page.getByRole("button", { name: "Be a device" }).click();
    await page.getByLabel("User").fill("vera");
    await page.getByLabel("Password").fill("wrong");
    await page.getByRole("button", { name: "Sign in" }).click();
    await expect(page.getByRole("alert")).not.toBeEmpty();
    await page.getByLabel("Password").fill(password);
    await page.getByRole("button", { name: "Sign in" }).click();
    await expect(page.locator("output")).toHaveText('device "phone"');
    await expect(page.locator("form")).toBeHidden();
  } finally {
    await guarded.kill("SIGTERM");
  }
});
