// The dashboard at drivers of the field, as they are published.
import { expect, test } from "@playwright/test";
import { arrange } from "../board";
import { pythonDriver, startPeer } from "../peers";
import { freePort, startGateway, webRoot } from "../processes";

test("Reynard is driven, is spoken to, and has the colour that its form shows", async ({ page }) => {
  const [port, http] = [await freePort(), await freePort()];
  const quiet = ["--quiet", "--disable-ascii-socket", "--http-port", String(http)];
  const reynard = pythonDriver("reynard_the_robot", [...quiet, `--robotraconteur-tcp-port=${port}`]);
  reynard.start();
  const url = `rr+tcp://127.0.0.1:${port}/?service=reynard`;
  const device = { name: "fox", url, mode: "shared" }; // it makes two objects for two clients at once, and fails
  const gateway = await startGateway("fox", url, webRoot, { devices: [device] });
  try {
    await page.goto(`${gateway.url}#/devices/fox/reynard?view=board`);
    const values = page.locator('[data-panel="table"]').first();
    const place = values.getByRole("row", { name: /^robot_position/ });
    const form = page.locator('[data-panel="form"]');
    const choose = (member: string) => form.getByLabel("Member").selectOption(member);

    await choose("teleport");
    await form.getByLabel(/^x /).fill("120"); // it takes metres, and tells millimetres
    await form.getByRole("button", { name: "Call teleport" }).click();
    await expect(form.getByRole("alert")).toContainText("Teleport target position is out of range");
    await form.getByLabel(/^x /).fill("0.12");
    await form.getByLabel(/^y /).fill("-0.04");
    await form.getByRole("button", { name: "Call teleport" }).click();
    await expect(place).toContainText("[120, -40");
    await choose("drive_robot");
    await form.getByLabel(/^vel_x /).fill("0.05");
    await form.getByLabel(/^timeout /).fill("0.5");
    await form.getByRole("button", { name: "Call drive_robot" }).click();
    await expect(place).toContainText(/\[1[3-5]\d\.?\d*, -40/);
    await expect(page.locator('[data-panel="plot"] .freshness').first()).toContainText("a second");

    await expect(page.locator('[data-panel="log"]')).toContainText("Listening to new_message");
    await speakTo(http, "Good morning");
    await expect(page.locator('[data-panel="log"]')).toContainText(/new_message.*Good morning/);

    await choose("color");
    const colour = form.getByLabel(/^color /);
    await expect(colour).toHaveValue(/^\[?0\.9\d*, /);
    await colour.fill("[0.1, 0.2, 0.3]");
    await form.getByRole("button", { name: "Set color" }).click();
    await expect(form.getByRole("status")).toContainText("done");
    await page.reload();
    await choose("color");
    await expect(colour).toHaveValue(/^\[?0\.1, 0\.2, 0\.3\]?$/);
    await arrange(page);
    await expect(form.getByLabel("Member")).toHaveValue("color");
  } finally {
    await gateway.program.kill("SIGTERM");
    await reynard.kill();
  }
});

test("the camera driver's pictures have the colour that its settings give, and its board says what it is", async ({
  page,
}) => {
  const camera = await startPeer("test/interop/peers/camera.py", "camera");
  try {
    await page.goto(`${camera.url}#/devices/peer/camera`);
    const picture = page.locator('[data-panel="image"]');
    await picture.getByRole("button", { name: "Start stream" }).click();
    const blue = () =>
      picture
        .locator("canvas")
        .evaluate((canvas) => (canvas as HTMLCanvasElement).getContext("2d")?.getImageData(7, 7, 1, 1).data[2]);
    await expect.poll(blue).toBeGreaterThan(190);

    const form = (name: string) => page.locator(`[data-form="${name}"]`);
    await form("setf_param")
      .getByLabel(/^param_name /)
      .fill("brightness");
    await form("setf_param")
      .getByLabel(/^value /)
      .fill("20");
    await form("setf_param").getByRole("button", { name: "Call setf_param" }).click();
    await expect.poll(blue).toBeLessThan(30);
    await form("getf_param")
      .getByLabel(/^param_name /)
      .fill("brightness");
    await form("getf_param").getByRole("button", { name: "Call getf_param" }).click();
    await expect(form("getf_param").getByRole("status")).toContainText("20");

    const table = (member: string) =>
      page.locator('[data-panel="table"]').filter({ has: page.getByRole("heading", { name: member }) });
    await expect(table("camera_info").getByRole("row", { name: "name film" })).toBeVisible();
    await expect(table("param_info")).toContainText("Brightness of the camera (CAP_PROP_BRIGHTNESS property)");
  } finally {
    await camera.stop();
  }
});

/** As somebody at Reynard's own page does, whose scripts come from elsewhere: by Socket.IO, whose version 4 may be polled. */
async function speakTo(port: number, message: string): Promise<void> {
  const url = `http://127.0.0.1:${port}/socket.io/?EIO=4&transport=polling`;
  const opened = await (await fetch(url)).text();
  const { sid } = JSON.parse(opened.slice(1)) as { sid: string };
  for (const body of ["40", `42${JSON.stringify(["new_message", message])}`])
    await fetch(`${url}&sid=${sid}`, { method: "POST", body });
}
