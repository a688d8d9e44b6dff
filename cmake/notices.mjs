// The copyright notices of others' work in what is shipped, from the packages themselves: those of npm packages that Vite puts
// into a site, and those of Debian packages of which the headers, or a runtime, are compiled in (compiled_in.json).
// `node cmake/notices.mjs programs|wasm FILE` writes those of what is compiled.
import { readFileSync, readdirSync, writeFileSync } from "node:fs";
import path from "node:path";
import { fileURLToPath } from "node:url";

const compiledIn = JSON.parse(readFileSync(new URL("compiled_in.json", import.meta.url), "utf8"));

const entry = (title, text) => `${title}\n${"=".repeat(title.length)}\n\n${text.trim()}\n`;

/**
 * The licence of Boost asks for no notice beside compiled code, and its file has two megabytes of names.
 * @param names Debian packages
 * @returns for each its name and its copyright file
 */
const debianNotices = (names) =>
  names
    .filter((name) => !name.startsWith("libboost"))
    .map((name) => entry(name, readFileSync(`/usr/share/doc/${name}/copyright`, "utf8")));

/**
 * @param ids of modules
 * @returns for each npm package that they are of its name, its version and its terms: the files, or what package.json says
 * @throws Error if a package has neither
 */
function npmNotices(ids) {
  const folders = new Set();
  for (const id of ids) {
    const [folder] = /^.*[\\/]node_modules[\\/](?:@[^\\/]+[\\/])?[^\\/]+(?=[\\/])/.exec(id) ?? [];
    if (folder && path.isAbsolute(folder)) folders.add(folder);
  }
  return [...folders].sort().map((folder) => {
    const { name, version, license, author, homepage } = JSON.parse(
      readFileSync(path.join(folder, "package.json"), "utf8"),
    );
    const files = readdirSync(folder)
      .filter((file) => /^(licen[cs]e|copying|notice)/i.test(file))
      .sort();
    const texts = files.map((file) => readFileSync(path.join(folder, file), "utf8"));
    if (files.length === 0 && !license)
      throw new Error(`${folder}: nothing says the terms of ${name}, which is in the bundle`);
    if (files.length === 0) texts.push([license, author?.name ?? author, homepage].filter(Boolean).join("\n"));
    return entry(`${name} ${version}`, texts.join("\n\n"));
  });
}

/**
 * A plugin of Vite: licenses.txt beside the page, with the notices of each package that is in the bundle.
 * @param further notices of what is not a module
 */
export function licences(further = () => []) {
  return {
    name: "licences",
    generateBundle(_, bundle) {
      const ids = Object.values(bundle).flatMap((file) => file.moduleIds ?? []);
      const source = [...npmNotices(ids), ...further()].join("\n\n");
      this.emitFile({ type: "asset", fileName: "licenses.txt", source });
    },
  };
}

export const wasmNotices = () => debianNotices(compiledIn.wasm);

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const [what, file] = process.argv.slice(2);
  writeFileSync(file, debianNotices(compiledIn[what]).join("\n\n"));
}
