// USB devices on the dashboard: chosen by a click, listed with their services, used without the gateway.
import path from "node:path";
import type { Page } from "@playwright/test";
import { expect, test } from "../lab_test";
import { startGateway, webRoot } from "../processes";
import { makeUsbSite } from "../usb_site";

/** A navigator.usb whose one device leads to the robot; the user chooses it when asked. */
const setup = `
const granted = [];
const usb = new EventTarget();
usb.getDevices = async () => [...granted];
usb.requestDevice = async () => {
  const { openWebsocket } = await import("/usb-test/internal.js");
  const { FakeUsbDevice } = await import("/usb-test/fake_usb.js");
  const { devices } = await (await fetch("/api/v1/devices")).json();
  const code = await WebAssembly.compile(await (await fetch("/usb-test/test_usb_device.wasm")).arrayBuffer());
  const robot = devices.find(({ name }) => name === "create");
  const device = await FakeUsbDevice.make(code, { name: robot.node_name, packetSize: 512 });
  const id = [...robot.node_id].flatMap((letter) => [letter.charCodeAt(0), 0]);
  device.replaceString(4, [2 + id.length, 3, ...id]);
  const relay = "ws://" + location.host + "/devices/create?service=Create";
  device.accept = () => (_url, listener) =>
    new Promise((resolve) => {
      const transport = openWebsocket(new URL(relay), { ...listener, opened: () => resolve(transport) });
    });
  granted.push(device);
  return device;
};
globalThis.unplug = () => {
  const device = granted.pop();
  device.unplug("NotFoundError");
  usb.dispatchEvent(Object.assign(new Event("disconnect"), { device }));
};
Object.defineProperty(navigator, "usb", { value: usb });
`;

async function fakeUsb(page: Page): Promise<void> {
  const site = makeUsbSite();
  await page.route("**/usb-test/**", (route) =>
    route.fulfill({ path: path.join(site, new URL(route.request().url()).pathname.slice(10)) }),
  );
  await page.addInitScript(setup);
}

test("a USB device is chosen, listed and driven, and goes when it is unplugged", async ({ page, lab }) => {
  // The device answers by its own node; a shared one would by the gateway's.
  const gateway = await startGateway("create", lab.createUrl, webRoot);
  await fakeUsb(page);
  await page.goto(gateway.url);
  await expect(page.locator('[data-device="create"] [data-state="online"]')).toBeVisible();
  await page.getByRole("button", { name: "Connect USB device" }).click();
  const row = page.locator('[data-device^="usb:"]');
  await expect(row.locator('[data-state="online"]')).toBeVisible();
  await row.getByRole("link", { name: /^Create/ }).click();
  await expect(page.locator('[data-link="online"]')).toBeVisible();
  await expect(page.getByRole("button", { name: "Forward" })).toBeEnabled();
  await page.evaluate("unplug()");
  await expect(page.locator('[data-link="lost"]')).toContainText(/unplugged|is gone|may use no USB device/);
  await page.goto(`${gateway.url}#/`);
  await expect(page.locator('[data-device="create"]')).toBeVisible();
  await expect(row).toHaveCount(0);
  await gateway.program.kill();
});

test("where there is no WebUSB, nothing offers it", async ({ page, lab }) => {
  await page.addInitScript('Object.defineProperty(navigator, "usb", { value: undefined })');
  await page.goto(lab.url);
  await expect(page.locator('[data-device="create"]')).toBeVisible();
  await expect(page.getByRole("button", { name: "Connect USB device" })).toHaveCount(0);
});
