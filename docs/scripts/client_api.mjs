// The reference of rrgate-client, by TypeDoc from its sources.
import { mkdtemp, readFile, readdir, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import path from "node:path";
import { Application } from "typedoc";

/** @returns {Promise<[string, string][]>} names and texts of its pages */
export async function clientPages(repository) {
  const client = path.join(repository, "wasm-client");
  const out = await mkdtemp(path.join(tmpdir(), "rrgate-docs-"));
  try {
    const app = await Application.bootstrapWithPlugins({
      plugin: ["typedoc-plugin-markdown"],
      entryPoints: [path.join(client, "ts/index.ts")],
      tsconfig: path.join(client, "tsconfig.json"),
      name: "rrgate-client",
      readme: "none",
      disableSources: true,
      excludePrivate: true,
      excludeInternal: true,
      router: "member",
      excludeExternals: true,
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
