// The notices beside the page: of each package that the bundler put into it, and of what is compiled into its WebAssembly.
import { mkdir, mkdtemp, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import path from "node:path";
import { fileURLToPath } from "node:url";
import { build, type Rollup } from "vite";
import { licences } from "../../cmake/notices.mjs";

const web = fileURLToPath(new URL("../../web/", import.meta.url));

async function bundled() {
  const made = await build({ root: web, logLevel: "silent", build: { write: false, sourcemap: true } });
  return (made as Rollup.RollupOutput).output;
}

test("each package in the page has its notice beside it", async () => {
  const output = await bundled();
  const sources = output.flatMap((file) => (file.type === "chunk" ? (file.map?.sources ?? []) : []));
  const names = new Set(sources.flatMap((source) => /node_modules\/((?:@[^/]+\/)?[^/]+)\//.exec(source)?.[1] ?? []));
  expect([...names].sort()).toEqual(expect.arrayContaining(["preact", "three", "uplot"]));
  const file = output.find((each) => each.fileName === "licenses.txt");
  const text = file?.type === "asset" ? String(file.source) : "";
  for (const name of names) expect(text).toMatch(new RegExp(`^${name} [0-9][0-9.]*\n=+\n`, "m"));
  expect(text).toMatch(/^emscripten\n=+\n/m);
  expect(text).toContain("Permission is hereby granted, free of charge");
}, 60_000);

test("a package without a file of its terms has those of its package.json, or is refused", async () => {
  const folder = await mkdtemp(path.join(tmpdir(), "licenses-"));
  onTestFinished(() => rm(folder, { recursive: true }));
  const at = path.join(folder, "node_modules/@x/y");
  await mkdir(at, { recursive: true });
  const texts: string[] = [];
  const plugin = licences();
  const make = () => {
    const bundle = { "page.js": { moduleIds: [path.join(at, "dist/style.css")] }, "page.css": {} };
    plugin.generateBundle.call({ emitFile: ({ source }) => String(texts.push(source)) }, {}, bundle);
  };
  await writeFile(
    path.join(at, "package.json"),
    `{"name": "@x/y", "version": "1.2.3", "license": "MIT", "author": "Ada"}`,
  );
  make();
  expect(texts).toEqual(["@x/y 1.2.3\n==========\n\nMIT\nAda\n"]);
  await writeFile(path.join(at, "package.json"), `{"name": "@x/y", "version": "1.2.3"}`);
  expect(make).toThrow("nothing says the terms of @x/y");
});
