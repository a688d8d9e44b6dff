// A USB device in a page and in a worker of a real browser: its navigator.usb is the one of the client's tests, and behind
// the device is a service that the gateway leads to.
import { writeFileSync } from "node:fs";
import path from "node:path";
import { expect, test } from "@playwright/test";
import type { Page } from "@playwright/test";
import { startTestService } from "../processes";
import { makeUsbSite } from "../usb_site";

const script = `
import { connect, listUsbDevices, requestUsbDevice } from "./index.js";
import { openWebsocket } from "./internal.js";
import { FakeUsb, FakeUsbDevice } from "./fake_usb.js";

const relay = new URL("/devices/big?service=interop", location);
relay.protocol = "ws:";
const { devices } = await (await fetch("/api/v1/devices")).json();
const code = await WebAssembly.compileStreaming(fetch("./test_usb_device.wasm"));
const device = await FakeUsbDevice.make(code, { name: devices[0].node_name, packetSize: 512 });
device.accept = () => (_url, listener) =>
  new Promise((resolve) => {
    const transport = openWebsocket(relay, { ...listener, opened: () => resolve(transport) });
  });
const usb = new FakeUsb();
Object.defineProperty(navigator, "usb", { value: usb });

/** Whether what speaks to USB devices has been loaded. */
const isLoaded = () => performance.getEntriesByType("resource").some(({ name }) => name.endsWith("/rrgate-usb.wasm"));

export async function run(isPage) {
  const said = { loadedBefore: isLoaded() };
  if (isPage) {
    usb.choice = device;
    said.chosen = (await requestUsbDevice()).nodeName;
  } else {
    usb.plug(device);
  }
  const [node] = await listUsbDevices();
  said.isSameNode = node.nodeName === devices[0].node_name;
  const robot = await connect("rr+usb:///?service=interop&nodename=" + node.nodeName);
  said.sum = await robot.add(2, 3);
  const ramp = await robot.ramp(20_000);
  said.ramp = ramp.length + " doubles, wrong at " + ramp.findIndex((value, index) => value !== index);
  said.counted = [];
  for await (const number of robot.count_up(1, 3)) said.counted.push(number);
  const end = new Promise((resolve) => robot.$.onClose(resolve));
  const call = robot.add(1, 1).catch((error) => error.subName);
  usb.unplug(device);
  said.call = await call;
  said.end = (await end).message;
  said.loadedAfter = isLoaded();
  return said;
}
`;

/** Asks while it loads, without a click: what a test runs in a page later counts as one. */
const own = `
import { connect, listUsbDevices, requestUsbDevice } from "./index.js";
const message = (error) => error.message;
const asked = requestUsbDevice().catch(message);
globalThis.said = {
  asked: await asked,
  listed: await listUsbDevices(),
  connected: await connect("rr+usb:///?nodename=robot&service=interop").catch(message),
};
`;

function makeSite(): string {
  const site = makeUsbSite();
  writeFileSync(path.join(site, "usb_script.js"), script);
  writeFileSync(path.join(site, "worker.js"), 'import { run } from "./usb_script.js"; postMessage(await run(false));');
  writeFileSync(path.join(site, "own.js"), own);
  writeFileSync(
    path.join(site, "own.html"),
    '<!doctype html><title>USB</title><script type="module" src="own.js"></script>',
  );
  writeFileSync(path.join(site, "index.html"), "<!doctype html><title>USB</title>");
  return site;
}

let gateway: Awaited<ReturnType<typeof startTestService>>;

test.beforeAll(async () => {
  gateway = await startTestService(makeSite());
});

test.afterAll(() => gateway?.stop());

/** The gateway has to know who its device is. */
async function open(page: Page): Promise<void> {
  await expect(async () => {
    const answer = (await (await page.request.get(`${gateway.url}api/v1/devices`)).json()) as {
      devices: Record<"node_name", string>[];
    };
    expect(answer.devices[0]?.node_name).not.toBe("");
  }).toPass();
  await page.goto(gateway.url);
}

const expected = {
  loadedBefore: false,
  isSameNode: true,
  sum: 5,
  ramp: "20000 doubles, wrong at -1",
  counted: [1, 2, 3],
  call: "connection_lost",
  end: expect.stringMatching(
    /USB device "Test robot" \(1209:5252\): .*(unplugged|the device is gone); plug it in again$/,
  ),
  loadedAfter: true,
};

test("a page lets the user choose a USB device and speaks to the service behind it", async ({ page }) => {
  await open(page);
  const said = await page.evaluate(async () => (await import(new URL("usb_script.js", location.href).href)).run(true));
  expect(said).toEqual({ ...expected, chosen: expect.any(String) });
});

test("a worker speaks to the same device", async ({ page }) => {
  await open(page);
  const said = await page.evaluate(
    () =>
      new Promise((resolve, reject) => {
        const worker = new Worker("worker.js", { type: "module" });
        worker.onerror = (error) => reject(new Error(error.message));
        worker.onmessage = ({ data }) => resolve(data);
      }),
  );
  expect(said).toEqual(expected);
});

test("where there is no WebUSB, a page hears so", async ({ page }) => {
  await page.goto(gateway.url);
  const said = await page.evaluate(async () => {
    Object.defineProperty(navigator, "usb", { value: undefined });
    const { connect } = await import(new URL("index.js", location.href).href);
    return connect("rr+usb:///?nodename=robot&service=interop").catch((error: Error) => error.message);
  });
  expect(said).toContain("this browser has no WebUSB");
});

test("the browser's own WebUSB takes what it is asked", async ({ page }) => {
  await page.goto(new URL("own.html", gateway.url).href);
  const said = await page.waitForFunction(() => (globalThis as { said?: Record<string, unknown> }).said);
  expect(await said.jsonValue()).toEqual({
    asked: expect.stringMatching(/^the user cannot be asked .* user gesture/),
    listed: [],
    connected: expect.stringContaining("let the user choose one with requestUsbDevice()"),
  });
});
