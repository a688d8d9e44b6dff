// What is published: versions that agree, and code that a strict page can load.
import { readdirSync, readFileSync } from "node:fs";
import { version } from "../../wasm-client/dist/index.js";

const package_file = new URL("../../wasm-client/package.json", import.meta.url);
const dist = new URL("../../wasm-client/dist/", import.meta.url);
const manifest = JSON.parse(readFileSync(package_file, "utf8")) as {
  version: string;
  dependencies?: object;
  imports: Record<string, Record<string, string>>;
};
const read = (file: string) => readFileSync(new URL(file, dist), "utf8");

it("has one version", () => {
  expect(version).toBe(manifest.version);
  expect(readFileSync(new URL("../../CMakeLists.txt", import.meta.url), "utf8")).toContain(`VERSION ${version}`);
});

it("depends on nothing", () => {
  expect(manifest.dependencies).toBeUndefined();
});

it("needs no eval, no shared memory and nothing of Node in a page", () => {
  const ours = readdirSync(dist, { encoding: "utf8", recursive: true });
  for (const file of ours.filter((name) => name.endsWith(".js") && !name.endsWith("_node.js"))) {
    expect(read(file), file).not.toMatch(/\beval\(|new Function\(|SharedArrayBuffer|require\(/);
    expect(read(file), file).not.toMatch(/from "node:|import\("node:|process\./);
  }
});

it("names the wasm file where bundlers look for it", () => {
  expect(read("load_wasm_web.js")).toContain('new URL("./rrgate.wasm", import.meta.url)');
});

it("knows a file for every import of its own", () => {
  for (const targets of Object.values(manifest.imports)) {
    for (const target of Object.values(targets)) expect(readFileSync(new URL(target, package_file), "utf8")).not.toBe("");
  }
});
