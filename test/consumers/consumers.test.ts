// The package as npm packs it, used as its users do: in each bundler without configuration, and in each engine. What a
// bundle or a program shows is the version that the core was asked for, and a value of the demo robot where it can connect.
import { execFile, spawn, type ChildProcess } from "node:child_process";
import { once } from "node:events";
import { cp, mkdir, mkdtemp, readdir, readFile, rm, writeFile } from "node:fs/promises";
import { createServer } from "node:http";
import type { AddressInfo } from "node:net";
import { extname, join } from "node:path";
import { createInterface } from "node:readline";
import { promisify } from "node:util";

const here = import.meta.dirname;
const root = join(here, "../..");
const client = join(root, "wasm-client");
const { version } = JSON.parse(await readFile(join(client, "package.json"), "utf8")) as { version: string };

/** Lies here, so that it finds the frameworks of this package. */
let folder: string;
let demo: ChildProcess;
let robot: string;

const run = (program: string, args: string[], cwd = folder) =>
  promisify(execFile)(program, args, {
    cwd,
    env: { ...process.env, NODE_ENV: "production", NEXT_TELEMETRY_DISABLED: "1" },
  });
const tool = (name: string, ...args: string[]) => run(join(here, "node_modules/.bin", name), args);

beforeAll(async () => {
  folder = await mkdtemp(join(here, "trial-"));
  const staged = join(folder, "staged");
  await mkdir(staged);
  for (const part of ["dist", "package.json", "README.md"])
    await cp(join(client, part), join(staged, part), { recursive: true });
  await run("npm", ["pkg", "delete", "scripts", "devDependencies"], staged);
  const { stdout } = await run("npm", ["pack", "--silent", "--ignore-scripts", "--pack-destination", folder], staged);
  await writeFile(join(folder, "package.json"), '{ "type": "module", "private": true }');
  const options = ["--offline", "--no-audit", "--no-fund", "--omit=optional", "--omit=peer", "--no-save"];
  await run("npm", ["install", ...options, join(folder, stdout.trim())]);
  await writeFile(join(folder, "page.js"), page("rrgate-client"));
  await writeFile(join(folder, "index.html"), '<body><script type="module" src="./page.js"></script>');
  // The same with the core in a worker, whose script bundlers have to find as well.
  await mkdir(join(folder, "threaded"));
  await writeFile(join(folder, "threaded/page.js"), page("rrgate-client/worker") + tell);
  await cp(join(folder, "index.html"), join(folder, "threaded/index.html"));
  [demo, robot] = await startDemo();
}, 60_000);
afterAll(async () => {
  demo.kill();
  await once(demo, "exit");
  await rm(folder, { recursive: true, force: true });
});

async function startDemo(): Promise<[ChildProcess, string]> {
  const program = join(root, "build/release/server/rrgate");
  const child = spawn(program, ["demo", "--port", "0", "--no-browser"], { stdio: ["ignore", "pipe", "inherit"] });
  for await (const line of createInterface({ input: child.stdout })) {
    const url = /^rrgate demo: http(:\/\/\S+)/.exec(line)?.[1];
    if (url) return [child, `ws${url}devices/create?service=Create`];
  }
  throw new Error("the demo ended before it listened");
}

/** A page that shows the version of the core, or why there is none. */
const page = (name: string) => `import { preload, version } from "${name}";
const show = (text) => { document.body.innerHTML = '<p id="shown">' + text + "</p>"; };
preload().then(() => show(version), (error) => show(String(error)));
`;
/** A page that tells what it shows in its title as well: see told(). */
const tell = `new MutationObserver(() => {
  document.title = document.getElementById("shown").textContent;
}).observe(document.body, { childList: true });
`;
const program = (url: string) => `import { connect, version } from "rrgate-client";
const robot = await connect("${url}");
console.log(version, typeof await robot.DistanceTraveled.get());
await robot.$.close();
`;

/** What Chromium shows of a page in `out`, as `look` finds it. A page without one of its own loads `script`. */
async function show(out: string, script?: string, look = dumped): Promise<string> {
  if (script) await writeFile(join(folder, out, "index.html"), `<body><script type="module" src="${script}"></script>`);
  const types: Record<string, string> = { ".html": "text/html", ".js": "text/javascript", ".wasm": "application/wasm" };
  const server = createServer((request, response) => {
    const { pathname } = new URL(request.url ?? "/", "http://localhost");
    const file = join(folder, out, pathname === "/" ? "index.html" : pathname);
    readFile(file).then(
      (bytes) => response.setHeader("Content-Type", types[extname(file)] ?? "text/plain").end(bytes),
      () => response.writeHead(404).end(),
    );
  });
  await once(server.listen(0, "127.0.0.1"), "listening");
  const { port } = server.address() as AddressInfo;
  try {
    return await look(`http://127.0.0.1:${port}/`);
  } finally {
    server.close();
  }
}

/**
 * What a page shows that has a worker, or its core within. Virtual time, which dumped() has, waits for the network,
 * but neither for workers nor for a core that is compiled: Chromium runs until it is told.
 */
async function told(url: string): Promise<string> {
  const flags = ["--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-port=0"];
  const browser = spawn("chromium", [...flags, `--user-data-dir=${join(folder, "profile")}`, url], {
    stdio: ["ignore", "ignore", "pipe"],
  });
  try {
    const lines = createInterface({ input: browser.stderr });
    for await (const line of lines) {
      const debugged = /ws:\/\/([^/]*)/.exec(line)?.[1];
      if (!debugged) continue;
      for (;;) {
        const pages = (await (await fetch(`http://${debugged}/json/list`)).json()) as { url: string; title: string }[];
        const title = pages.find((each) => each.url.startsWith(url))?.title ?? "";
        if (title !== "" && !url.includes(title)) return title;
        await new Promise((resolve) => setTimeout(resolve, 50));
      }
    }
    throw new Error("Chromium ended");
  } finally {
    browser.kill();
    await once(browser, "exit");
  }
}

async function dumped(url: string): Promise<string> {
  const flags = ["--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=10000", "--dump-dom"];
  const { stdout } = await run("chromium", [...flags, url]);
  return /<p id="shown">(.*?)<\/p>/.exec(stdout)?.[1] ?? stdout;
}

/** The first file in `out` that matches. */
async function find(out: string, pattern: RegExp): Promise<string> {
  const name = (await readdir(join(folder, out))).find((each) => pattern.test(each));
  if (name === undefined) throw new Error(`${out} has no file like ${pattern}`);
  return join(out, name);
}

const dist = (name: string) => join(folder, "node_modules/rrgate-client/dist", name);

it("packs what a page needs, and installs without anything else", async () => {
  const names = await readdir(dist(""));
  expect(names).toEqual(expect.arrayContaining(["index.js", "client.js", "rrgate.wasm", "inline.js", "react", "vue"]));
  expect(names).not.toContain("internal.js");
  expect(await readdir(dist("worker"))).not.toContain("host.js");
});

it("is bundled by esbuild, with the core copied beside it", async () => {
  await writeFile(join(folder, "inline.js"), page("rrgate-client/inline") + tell);
  await writeFile(
    join(folder, "vue.js"),
    `import { useDevice } from "rrgate-client/vue"; document.body.innerHTML = '<p id="shown">' + typeof useDevice + "</p>";`,
  );
  await tool(
    "esbuild",
    "page.js",
    "inline.js",
    "vue.js",
    "--bundle",
    "--splitting",
    "--format=esm",
    "--outdir=esbuild",
  );
  await cp(dist("rrgate.wasm"), join(folder, "esbuild/rrgate.wasm"));
  expect(await show("esbuild", "page.js")).toBe(version);
  expect(await show("esbuild", "vue.js")).toBe("function");
  await rm(join(folder, "esbuild/rrgate.wasm"));
  expect(await show("esbuild", "inline.js", told)).toBe(version);
}, 30_000);

it("is bundled by esbuild, with worker and core copied beside it", async () => {
  await tool("esbuild", "threaded/page.js", "--bundle", "--splitting", "--format=esm", "--outdir=esbuild-threaded");
  for (const file of ["rrgate.wasm", "worker_thread.js"]) await cp(dist(file), join(folder, "esbuild-threaded", file));
  expect(await show("esbuild-threaded", "page.js", told)).toBe(version);
}, 30_000);

it("is bundled by Rollup, with the core copied beside it", async () => {
  const { stderr } = await tool(
    "rollup",
    "page.js",
    "-p",
    "node-resolve={browser:true}",
    "--format=es",
    "--dir=rollup",
  );
  expect(stderr).not.toMatch(/warning/i);
  await cp(dist("rrgate.wasm"), join(folder, "rollup/rrgate.wasm"));
  expect(await show("rollup", "page.js")).toBe(version);
}, 30_000);

it("is bundled by Vite, which ships the core by itself", async () => {
  await tool("vite", "build", "--base", "./", "--outDir", "vite");
  expect(await show("vite")).toBe(version);
}, 30_000);

it("is bundled by Vite with its worker", async () => {
  await tool("vite", "build", "threaded", "--base", "./", "--outDir", "../vite-threaded");
  expect(await show("vite-threaded", undefined, told)).toBe(version);
}, 30_000);

it.each([
  ["", dumped],
  ["threaded", told],
])(
  "runs in the development server of Vite %s",
  async (root, look) => {
    const server = spawn(join(here, "node_modules/.bin/vite"), ["--port", "0", "--host", "127.0.0.1"], {
      cwd: join(folder, root),
      stdio: ["ignore", "pipe", "inherit"],
    });
    try {
      for await (const line of createInterface({ input: server.stdout })) {
        const url = /http:\S+/.exec(line.replace(/\x1b\[\d+m/g, ""))?.[0];
        if (!url) continue;
        expect(await look(url)).toBe(version);
        break;
      }
    } finally {
      server.kill();
      await once(server, "exit");
    }
  },
  30_000,
);

it("is bundled by webpack, which ships the core by itself", async () => {
  await tool("webpack", "build", "--entry", "./page.js", "--mode", "production", "--output-path", "webpack");
  expect(await show("webpack", "main.js")).toBe(version);
}, 30_000);

it("is bundled by webpack with its worker", async () => {
  const entry = ["--entry", "./threaded/page.js", "--output-path", "webpack-threaded"];
  await tool("webpack", "build", "--mode", "production", ...entry);
  expect(await show("webpack-threaded", "main.js", told)).toBe(version);
}, 30_000);

it("is bundled by Parcel, which ships the core by itself", async () => {
  await tool("parcel", "build", "index.html", "--dist-dir", "parcel", "--cache-dir", "parcel-cache");
  expect(await show("parcel")).toBe(version);
}, 60_000);

it("is bundled by Parcel with its worker", async () => {
  // By its file: Parcel takes other entries of a package where the project says so, and the project is this repository.
  await writeFile(join(folder, "threaded/page.js"), page("../node_modules/rrgate-client/dist/worker.js") + tell);
  const folders = ["--dist-dir", "parcel-threaded", "--cache-dir", "parcel-cache"];
  await tool("parcel", "build", "threaded/index.html", ...folders);
  expect(await show("parcel-threaded", undefined, told)).toBe(version);
}, 60_000);

it("is bundled by Next.js, which ships the core by itself", async () => {
  await mkdir(join(folder, "app"));
  await writeFile(
    join(folder, "app/layout.js"),
    "export default ({ children }) => <html><body>{children}</body></html>;",
  );
  await writeFile(
    join(folder, "app/page.js"),
    '"use client";\nimport { useDevice } from "rrgate-client/react";\nimport { preload } from "rrgate-client";\n' +
      "export default () => <button onClick={() => preload()}>{typeof useDevice}</button>;",
  );
  await tool("next", "build");
  expect(await find(".next/static/media", /^rrgate\..*\.wasm$/)).toBeTruthy();
  expect(await readFile(join(folder, ".next/server/app/index.html"), "utf8")).toContain("<button>function</button>");
}, 120_000);

it.each(["bun", "deno"])(
  "connects in %s",
  async (engine) => {
    await writeFile(join(folder, "program.js"), program(robot));
    const { stdout } = await tool(engine, "run", ...(engine === "deno" ? ["--allow-all"] : []), "program.js");
    expect(stdout.trim()).toBe(`${version} number`);
  },
  30_000,
);

it("connects in a worker like those of Cloudflare, whose wasm is compiled before", async () => {
  await writeFile(
    join(folder, "worker.js"),
    `import wasm from "rrgate-client/rrgate.wasm";
    import { connect, init, version } from "rrgate-client";
    init({ wasm });
    export default { async fetch() {
      const robot = await connect("${robot}");
      const value = typeof await robot.DistanceTraveled.get();
      await robot.$.close();
      return new Response(version + " " + value);
    } };`,
  );
  const conditions = ["--conditions=workerd,worker,browser", "--external:*.wasm"];
  await tool("esbuild", "worker.js", "--bundle", "--splitting", "--format=esm", "--outdir=worker", ...conditions);
  await mkdir(join(folder, "worker/rrgate-client"));
  await cp(dist("rrgate.wasm"), join(folder, "worker/rrgate-client/rrgate.wasm"));
  const { Miniflare } = await import("miniflare");
  const worker = new Miniflare({
    modules: true,
    scriptPath: join(folder, "worker/worker.js"),
    modulesRules: [
      { type: "ESModule", include: ["**/*.js"] },
      { type: "CompiledWasm", include: ["**/*.wasm"] },
    ],
    compatibilityDate: "2025-01-01",
  });
  try {
    const response = await worker.dispatchFetch("http://localhost/");
    expect(await response.text()).toBe(`${version} number`);
  } finally {
    await worker.dispose();
  }
}, 60_000);
