// The clients of examples/thermostat in JavaScript, as docs/tutorials/page.md tells to run them: package, device, gateway.
import { execFileSync } from "node:child_process";
import { cpSync, existsSync, mkdirSync, mkdtempSync, rmSync, symlinkSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";
import { expect, test } from "@playwright/test";
import { Program, repositoryRoot, rrgate, startGateway } from "../processes";

const program = path.join(path.dirname(rrgate), "../test/examples/thermostat_device");
const example = path.join(repositoryRoot, "examples/thermostat");
const client = path.join(repositoryRoot, "wasm-client");

let folder: string;
let device: Program;
let gateway: { program: Program; url: string };

test.beforeAll(async () => {
  if (!existsSync(program)) throw new Error(`${program} is missing: build the target thermostat_device`);
  folder = mkdtempSync(path.join(tmpdir(), "rrgate-examples-"));
  const site = path.join(folder, "site");
  cpSync(path.join(example, "site"), site, { recursive: true });
  cpSync(path.join(client, "dist"), path.join(site, "rrgate-client"), { recursive: true });

  device = new Program(program, ["rr+tcp://127.0.0.1:0"]);
  device.start();
  const [url] = await device.waitForOutput(/rr\+tcp:\S+/);
  gateway = await startGateway("room", url, site);
});

test.afterAll(async () => {
  await gateway?.program.kill("SIGTERM");
  await device?.kill("SIGTERM");
  rmSync(folder, { recursive: true, force: true });
});

test("the client in Node, with the package as npm would install it", () => {
  const modules = path.join(folder, "node_modules");
  mkdirSync(path.join(modules, "rrgate-client"), { recursive: true });
  const packed = execFileSync("npm", ["pack", "--silent", "--pack-destination", folder, client], {
    encoding: "utf8",
  }).trim();
  const unpack = ["--strip-components=1", "-C", path.join(modules, "rrgate-client")];
  execFileSync("tar", ["-xzf", path.join(folder, packed), ...unpack]);
  symlinkSync(path.join(client, "node_modules/ws"), path.join(modules, "ws"));
  cpSync(path.join(example, "client.mjs"), path.join(folder, "client.mjs"));

  const url = `${gateway.url.replace("http", "ws")}devices/room?service=Thermostat`;
  const said = execFileSync("node", [path.join(folder, "client.mjs"), url], { encoding: "utf8", timeout: 30_000 });
  expect(said).toBe("21 degrees\n");
});

test("the page", async ({ page }) => {
  const complaints: string[] = [];
  page.on("pageerror", (error) => complaints.push(String(error)));
  page.on("console", (message) => {
    if (message.type() === "error" && !message.location().url.endsWith("favicon.ico")) complaints.push(message.text());
  });
  await page.goto(gateway.url);
  await expect(page.locator("p")).toHaveText(/^It is \d+(\.5)? degrees in here\.$/);
  await page.getByRole("button").click();
  await expect(page.locator("p")).toHaveText("It is 21 degrees in here.");
  expect(complaints).toEqual([]);
});
