// The reference of rrgate-client, by TypeDoc from its sources.
import { mkdtemp, readFile, readdir, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import path from "node:path";
import { Application } from "typedoc";

/** What a program imports, and its source: "rrgate-client/react" is a part of the package with a reference of its own. */
const ENTRIES = {
  "": "index.ts",
  "react/": "react/react.ts",
  "serve/": "serve/serve.ts",
  "svelte/": "svelte/svelte.ts",
  "vue/": "vue/vue.ts",
  "worker/": "worker.ts",
};
/** "rrgate-client/worker" has all of "rrgate-client" again: its pages are of what is different. */
const ELSEWHERE = { "worker.ts": ["**/wasm-client/ts/!(worker).ts", "**/wasm-client/ts/!(worker)/*.ts"] };

/** @returns {Promise<[string, string][]>} names and texts of its pages */
export async function clientPages(repository) {
  const pages = [];
  for (const [prefix, file] of Object.entries(ENTRIES))
    for (const [name, text] of await pagesOf(repository, file, `rrgate-client/${prefix}`.slice(0, -1)))
      pages.push([prefix + name, prefix + name === "index.md" ? text + others() : text]);
  return pages;
}

function others() {
  const links = Object.keys(ENTRIES).flatMap((prefix) =>
    prefix === "" ? [] : [`- [rrgate-client/${prefix.slice(0, -1)}](${prefix}index.md)`],
  );
  return `\n## Other entries of the package\n\n${links.join("\n")}\n`;
}

async function pagesOf(repository, file, title) {
  const client = path.join(repository, "wasm-client");
  const out = await mkdtemp(path.join(tmpdir(), "rrgate-docs-"));
  try {
    const app = await Application.bootstrapWithPlugins({
      plugin: ["typedoc-plugin-markdown"],
      entryPoints: [path.join(client, "ts", file)],
      tsconfig: path.join(client, "tsconfig.json"),
      name: title,
      readme: "none",
      disableSources: true,
      excludePrivate: true,
      excludeInternal: true,
      router: "member",
      excludeExternals: true,
      externalPattern: ["**/node_modules/**", ...(ELSEWHERE[file] ?? [])],
      outputs: [{ name: "markdown", path: out }],
      entryFileName: "index",
      hideBreadcrumbs: true,
      hidePageHeader: true,
      parametersFormat: "table",
      interfacePropertiesFormat: "table",
      enumMembersFormat: "table",
      useCodeBlocks: true,
      logLevel: "Error",
    });
    const project = await app.convert();
    if (!project || app.logger.hasErrors()) throw new Error("TypeDoc can't read wasm-client/ts");
    await app.generateOutputs(project);
    const names = (await readdir(out, { recursive: true })).filter((name) => name.endsWith(".md"));
    return await Promise.all(names.map(async (name) => [name, await readFile(path.join(out, name), "utf8")]));
  } finally {
    await rm(out, { recursive: true });
  }
}
