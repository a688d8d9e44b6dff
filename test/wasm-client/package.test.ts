// What is published: versions that agree, and code that a strict page can load.
import { readdirSync, readFileSync } from "node:fs";
import { version } from "../../wasm-client/dist/node.js";

const packageFile = new URL("../../wasm-client/package.json", import.meta.url);
const dist = new URL("../../wasm-client/dist/", import.meta.url);
const manifest = JSON.parse(readFileSync(packageFile, "utf8")) as {
  version: string;
  dependencies?: object;
  peerDependenciesMeta: object;
  exports: Record<string, string | Record<string, string>>;
};
const read = (file: string) => readFileSync(new URL(file, dist), "utf8");

it("has one version", () => {
  expect(version).toBe(manifest.version);
  expect(readFileSync(new URL("../../CMakeLists.txt", import.meta.url), "utf8")).toContain(`VERSION ${version}`);
});

it("depends on nothing", () => {
  expect(manifest.dependencies).toBeUndefined();
});

it("needs no eval, no shared memory, no bundler and nothing of Node in a page", () => {
  const scripts = readdirSync(dist, { encoding: "utf8", recursive: true }).filter((name) => name.endsWith(".js"));
  for (const file of scripts.filter((name) => name !== "node.js")) {
    expect(read(file), file).not.toMatch(/\beval\(|new Function\(|SharedArrayBuffer|require\(/);
    expect(read(file), file).not.toMatch(/from "node:|import\("node:|process\./);
    // What a page resolves by itself: paths. And the framework, which is there where its hooks are.
    for (const [, from] of read(file).matchAll(/\b(?:from|import)\s*\(?"([^"]*)"/g))
      expect(from, file).toMatch(/^(?:\.\.?\/|(?:react|vue)$)/);
  }
});

it("names the wasm files where bundlers look for them", () => {
  expect(read("client.js")).toContain('new URL("./rrgate.wasm",import.meta.url)');
  expect(read("usb/nodes.js")).toContain('new URL("./rrgate-usb.wasm",import.meta.url)');
  expect(read("serve/device.js")).toContain('new URL("./rrgate-serve.wasm",import.meta.url)');
});

it("loads what speaks to USB devices when there is one to speak to, and not before", () => {
  for (const file of readdirSync(dist).filter((name) => name.endsWith(".js"))) {
    expect(read(file), file).not.toMatch(/\bfrom\s*"\.\/usb\//);
  }
  expect(read("client.js")).toContain('import("./usb/nodes.js")');
  expect(read("client.js")).toContain('import("./definition/definition.js")');
});

it("loads what pages that are devices need where it is imported alone", () => {
  expect(manifest.exports["./serve"]).toMatchObject({ node: "./dist/serve/node.js", default: "./dist/serve/serve.js" });
  expect(read("client.js")).not.toContain("rrgate-serve");
});

it("loads two scripts in a page", () => {
  const scripts = readdirSync(dist).filter((name) => name.endsWith(".js"));
  expect(scripts.sort()).toEqual([
    "client.js",
    "index.js",
    "inline.js",
    "internal.js",
    "node.js",
    "thread.js",
    "worker.js",
    "worker_thread.js",
  ]);
  expect(read("index.js").match(/"\.[^"]*"/g)).toEqual(['"./client.js"']);
});

it("has what runs in a worker in one file, which bundlers find", () => {
  expect(manifest.exports["./worker"]).toMatchObject({ default: "./dist/worker.js" });
  expect(read("thread.js")).toContain('new Worker(new URL("./worker_thread.js",import.meta.url),{type:"module"})');
  expect(read("worker_thread.js")).toContain('new URL("./rrgate.wasm",import.meta.url)');
  expect(read("worker_thread.js")).not.toMatch(/\bimport\b(?!\.meta)|\bfrom"/);
  expect(read("client.js")).not.toContain("/worker");
  expect(read("client.js").match(/.{10}thread\.js/g)).toEqual(['import("./thread.js']); // for who says `worker: true`
  for (const file of ["thread.js", "worker.js", "worker/passage.js"])
    expect(read(file), file).not.toContain("/host.js");
});

it("loads what there is for a framework with that framework alone", () => {
  for (const [framework, file] of ["react", "svelte", "vue"].map((name) => [name, `${name}/${name}.js`] as const)) {
    expect(manifest.exports[`./${framework}`], framework).toMatchObject({ default: `./dist/${file}` });
    expect(read(file)).toContain('"../stores/stores.js"');
  }
  expect(read("client.js")).not.toContain("stores.js");
  expect(manifest.peerDependenciesMeta).toEqual({ react: { optional: true }, vue: { optional: true } });
});

it("has the files that it exports", () => {
  for (const targets of Object.values(manifest.exports)) {
    for (const target of [targets].flatMap((one) => (typeof one === "string" ? one : Object.values(one)))) {
      expect(readFileSync(new URL(target, packageFile), "utf8"), target).not.toBe("");
    }
  }
});
