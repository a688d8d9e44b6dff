// What a page needs for a navigator.usb of the tests' own.
import { execFileSync } from "node:child_process";
import { cpSync, existsSync, mkdtempSync, readFileSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";
import { repositoryRoot } from "./processes";

/** A folder with the client package as it is published, fake_usb.js of its tests, and test_usb_device.wasm. */
export function makeUsbSite(): string {
  const simulated = path.join(repositoryRoot, "build/wasm/test/wasm-client/usb_device/test_usb_device.wasm");
  if (!existsSync(simulated))
    throw new Error(`${simulated} is missing: build the target rrgate_test_usb_device (preset wasm)`);
  const site = mkdtempSync(path.join(tmpdir(), "rrgate-usb-site-"));
  cpSync(path.join(repositoryRoot, "wasm-client/dist"), site, { recursive: true });
  cpSync(simulated, path.join(site, "test_usb_device.wasm"));
  const fake = path.join(repositoryRoot, "test/wasm-client/fake_usb.ts");
  const how =
    "--ignoreConfig --skipLibCheck --strict --target es2022 --module esnext --moduleResolution bundler --rootDir".split(
      " ",
    );
  const tsc = path.join(repositoryRoot, "test/e2e/node_modules/.bin/tsc");
  execFileSync(tsc, [...how, repositoryRoot, "--outDir", site, fake]);
  const compiled = readFileSync(path.join(site, "test/wasm-client/fake_usb.js"), "utf8");
  writeFileSync(path.join(site, "fake_usb.js"), compiled.replaceAll("../../wasm-client/dist/", "./"));
  return site;
}
