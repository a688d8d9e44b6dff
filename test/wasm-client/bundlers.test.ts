// The package as npm packs it, in a page that each bundler makes: the bundle finds its core, and the core is there.
import { execFile } from "node:child_process";
import { cp, mkdir, mkdtemp, readdir, readFile, rm, symlink, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { promisify } from "node:util";

const client = fileURLToPath(new URL("../../wasm-client/", import.meta.url));
const run = (program: string, args: string[], cwd: string) => promisify(execFile)(program, args, { cwd });
let folder: string;

beforeAll(async () => {
  folder = await mkdtemp(join(tmpdir(), "rrgate-bundlers-"));
  const staged = join(folder, "staged");
  await mkdir(staged);
  for (const part of ["dist", "package.json", "README.md"])
    await cp(join(client, part), join(staged, part), { recursive: true });
  await run("npm", ["pkg", "delete", "scripts", "devDependencies"], staged);
  const { stdout } = await run("npm", ["pack", "--silent", "--ignore-scripts", "--pack-destination", folder], staged);
  await writeFile(join(folder, "package.json"), '{ "type": "module", "private": true }');
  const options = ["--offline", "--no-audit", "--no-fund", "--omit=optional", "--omit=peer", "--no-save"];
  await run("npm", ["install", ...options, join(folder, stdout.trim())], folder);
  // The framework is the page's own.
  await symlink(join(client, "node_modules/vue"), join(folder, "node_modules/vue"));
  await writeFile(join(folder, "page.js"), page("rrgate-client"));
  await writeFile(join(folder, "inline.js"), page("rrgate-client/inline"));
  await writeFile(
    join(folder, "vue.js"),
    'import { useDevice } from "rrgate-client/vue"; globalThis.shown = typeof useDevice;',
  );
  await writeFile(join(folder, "index.html"), '<script type="module" src="./page.js"></script>');
}, 60_000);
afterAll(() => rm(folder, { recursive: true, force: true }));

const page = (name: string) => `import { preload, version } from "${name}";
globalThis.shown = preload().then(() => version);
`;

/** What a bundle shows when it runs. Its files are where `fetch` of a page would find them. */
async function show(file: string): Promise<unknown> {
  const script = `globalThis.fetch = async (url) => new Response(
    await (await import("node:fs/promises")).readFile(new URL(url)), { headers: { "Content-Type": "application/wasm" } });
  await import(${JSON.stringify(file)});
  console.log(await globalThis.shown);`;
  const { stdout } = await run("node", ["--input-type=module", "--eval", script], folder);
  return stdout.trim();
}

const version = async () =>
  (JSON.parse(await readFile(join(client, "package.json"), "utf8")) as { version: string }).version;
const scriptOf = async (out: string) =>
  join(folder, out, (await readdir(join(folder, out))).find((name) => /^(index|main).*\.m?js$/.test(name)) ?? "none");

it("packs what a page needs, and installs without anything else", async () => {
  const names = await readdir(join(folder, "node_modules/rrgate-client/dist"));
  expect(names).toEqual(expect.arrayContaining(["index.js", "client.js", "rrgate.wasm", "inline.js", "react", "vue"]));
  expect(names).not.toContain("internal.js");
});

it("is bundled by esbuild, with the core copied beside it", async () => {
  const { build } = await import("esbuild");
  const common = { absWorkingDir: folder, bundle: true, format: "esm", splitting: true, logLevel: "silent" } as const;
  await build({ ...common, entryPoints: ["page.js", "inline.js", "vue.js"], outdir: "esbuild" });
  await cp(join(folder, "node_modules/rrgate-client/dist/rrgate.wasm"), join(folder, "esbuild/rrgate.wasm"));
  expect(await show(join(folder, "esbuild/page.js"))).toBe(await version());
  expect(await show(join(folder, "esbuild/vue.js"))).toBe("function");
  await rm(join(folder, "esbuild/rrgate.wasm"));
  expect(await show(join(folder, "esbuild/inline.js"))).toBe(await version());
}, 30_000);

it("is bundled by Rollup, with the core copied beside it", async () => {
  const { rollup } = await import("rollup");
  // In the place of @rollup/plugin-node-resolve.
  const dist = (file: string) => join(folder, "node_modules/rrgate-client/dist", file);
  const plugin = { name: "resolve", resolveId: (name: string) => (name === "rrgate-client" ? dist("index.js") : null) };
  const warnings: string[] = [];
  const bundle = await rollup({
    input: join(folder, "page.js"),
    plugins: [plugin],
    onwarn: ({ message }) => void warnings.push(message),
  });
  await bundle.write({ dir: join(folder, "rollup"), format: "es" });
  await bundle.close();
  expect(warnings).toEqual([]);
  await cp(dist("rrgate.wasm"), join(folder, "rollup/rrgate.wasm"));
  expect(await show(join(folder, "rollup/page.js"))).toBe(await version());
}, 30_000);

it("is bundled by Vite, which ships the core by itself", async () => {
  const { build } = await import("vite");
  await build({ root: folder, base: "./", logLevel: "silent", build: { outDir: "vite", modulePreload: false } });
  expect((await readdir(join(folder, "vite/assets"))).join()).toMatch(/rrgate-.*\.wasm/);
  expect(await show(await scriptOf("vite/assets"))).toBe(await version());
}, 30_000);

it("is bundled by webpack, which ships the core by itself", async () => {
  const { default: webpack } = await import("webpack");
  const stats = await new Promise<string>((resolve, reject) => {
    webpack(
      {
        context: folder,
        entry: "./page.js",
        mode: "production",
        experiments: { outputModule: true },
        output: { path: join(folder, "webpack"), module: true, chunkFormat: "module", publicPath: "auto" },
      },
      (error, result) => (error ? reject(error) : resolve(result?.toString({ all: false, errors: true }) ?? "")),
    );
  });
  expect(stats).toBe("");
  expect(await show(await scriptOf("webpack"))).toBe(await version());
}, 30_000);
