// The code that stands first in both READMEs, run as it stands but for the address: against the demo devices.
import { execFileSync } from "node:child_process";
import { mkdirSync, mkdtempSync, readFileSync, rmSync, symlinkSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";
import { expect, test } from "../lab_test";
import type { Lab } from "../processes";
import { repositoryRoot } from "../processes";

function run(readme: string, lab: Lab): string {
  const text = readFileSync(path.join(repositoryRoot, readme), "utf8");
  const [, code] = /```js\n(.*?)```/s.exec(text) ?? [];
  if (!code) throw new Error(`${readme} shows no JavaScript`);
  const address = lab.url.replace("http", "ws").replace(/\/$/, "");
  const finite = code.replace("console.log(packet);", "console.log(packet.Data.length); break;"); // another packet's bytes each time
  const folder = mkdtempSync(path.join(tmpdir(), "rrgate-readme-"));
  try {
    mkdirSync(path.join(folder, "node_modules"));
    symlinkSync(path.join(repositoryRoot, "wasm-client"), path.join(folder, "node_modules/rrgate-client"));
    const script = path.join(folder, "readme.mjs");
    writeFileSync(script, `${finite.replaceAll(/wss?:\/\/[\w.:]+/g, address)}\nprocess.exit(0);\n`);
    const env = { ...process.env, FORCE_COLOR: "0" };
    return execFileSync("node", [script], { encoding: "utf8", timeout: 30_000, env });
  } finally {
    rmSync(folder, { recursive: true, force: true });
  }
}

test("the README's robot", ({ lab }) => {
  expect(run("README.md", lab)).toMatch(/^-?\d+ mm\n52\n$/);
});

test("the README of rrgate-client, which leaves the robot standing", async ({ lab, request }) => {
  expect(run("wasm-client/README.md", lab)).toMatch(/^-?\d+\n52\n.+\n$/);
  const state = async (): Promise<unknown> =>
    (await request.get(`${lab.url}api/v1/devices/create/Create/state`)).json();
  await expect.poll(state).toMatchObject({ velocity: 0, turn_rate: 0 });
});
