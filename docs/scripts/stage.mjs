// Puts the pages of the site together in .vitepress/pages, for VitePress: those of this folder, those that lie elsewhere
// in the repository, and the reference, which is made from the sources. Links between files of the repository become
// links between pages; files that are linked, but are no page, become pages that show them.
import { existsSync, readdirSync, readFileSync, rmSync, statSync } from "node:fs";
import { cp, mkdir, writeFile } from "node:fs/promises";
import path from "node:path";
import { fileURLToPath } from "node:url";
import { configurationPage } from "./configuration.mjs";
import { commandsPage } from "./commands.mjs";
import { httpPage } from "./http.mjs";
import { clientPages } from "./client_api.mjs";
import { cppPages } from "./cpp_api.mjs";

const repository = fileURLToPath(new URL("../..", import.meta.url));
const target = path.join(repository, "docs/.vitepress/pages");

/** Pages that lie outside of docs/, and sources of which the reference is made: path in the repository, name in the site. */
const elsewhere = {
  "CHANGELOG.md": "changelog.md",
  "CODE_OF_CONDUCT.md": "code-of-conduct.md",
  "CONTRIBUTING.md": "contributing.md",
  "SECURITY.md": "reporting.md",
  "robdef/README.md": "definitions.md",
  "test/examples/paper/README.md": "paper.md",
  "test/interop/README.md": "interoperability.md",
  "wasm-client/README.md": "rrgate-client.md",
};
const generated = {
  "gateway-config/gateway.schema.json": ["reference/configuration.md", configurationPage],
  "server/main.cpp": ["reference/commands.md", commandsPage],
  "server/http/endpoints/gateway_openapi.json": ["reference/http.md", httpPage],
};
const aliases = {
  "README.md": "index.md",
  docs: "index.md",
  "docs/adr": "adr/0001-borrowed-message-tree.md",
  "docs/howto": "howto/add-transport.md",
  "wasm-client": "rrgate-client.md",
  robdef: "definitions.md",
  "include/rrgate": "reference/cpp/index.md",
  "wasm-client/ts/index.ts": "reference/rrgate-client/index.md",
};

const pages = new Map(); // name in the site -> text
const shown = new Set(); // files and folders that are shown as they are

/** Site page of a file of the repository, or undefined. */
function pageOf(file) {
  const known = elsewhere[file] ?? generated[file]?.[0] ?? aliases[file];
  if (known) return known;
  if (file.startsWith("docs/images/")) return file.slice("docs/".length);
  return file.startsWith("docs/") && file.endsWith(".md") ? file.slice("docs/".length) : undefined;
}

/** Rewrites the links of a page. `file`: where it lies in the repository; `page`: where in the site. */
function withSiteLinks(text, file, page) {
  return outsideOfCode(text, (prose) =>
    prose.replace(/(\]\()([^)\s]+)(\))/g, (whole, before, link, after) => {
      if (/^([a-z][a-z+.-]*:|#)/.test(link)) return whole;
      const [target, anchor] = link.split("#");
      const linked = path.posix.normalize(path.posix.join(path.posix.dirname(file), target)).replace(/\/$/, "");
      const to = pageOf(linked) ?? showPage(linked, file);
      return `${before}${path.posix.relative(path.posix.dirname(page), to) || path.posix.basename(to)}${anchor ? `#${anchor}` : ""}${after}`;
    }),
  );
}

function outsideOfCode(text, change) {
  return text
    .split(/(^```[\s\S]*?^```$)/m)
    .map((part, i) => (i % 2 ? part : change(part)))
    .join("");
}

/** A page that shows a file, or each file of a folder. */
function showPage(file, from) {
  const full = path.join(repository, file);
  if (!existsSync(full)) throw new Error(`${from} links to ${file}, which is not there`);
  if (file.endsWith(".md")) throw new Error(`${from} links to ${file}, which has no page: name one in stage.mjs`);
  shown.add(file);
  return `source/${file}${statSync(full).isDirectory() ? "/index" : ""}.md`;
}

const languages = {
  ".robdef": "txt",
  ".hpp": "cpp",
  ".cpp": "cpp",
  ".m": "matlab",
  ".mjs": "js",
  ".conf": "nginx",
  ".cfg": "ini",
  ".rules": "ini",
  ".in": "ini",
  ".socket": "ini",
  ".py": "python",
};

function shownText(file) {
  const full = path.join(repository, file);
  const entries = statSync(full).isDirectory() ? readdirSync(full, { withFileTypes: true }) : [];
  const folders = entries.filter((entry) => entry.isDirectory()).map(({ name }) => `- \`${name}/\``);
  const names = statSync(full).isDirectory() ? entries.filter((entry) => entry.isFile()).map(({ name }) => name) : [""];
  const parts = names.sort().map((name) => {
    const ending = path.extname(name || file);
    const text = readFileSync(path.join(full, name), "utf8").trimEnd();
    return `${name ? `## ${name}\n\n` : ""}\`\`\`\`${languages[ending] ?? (ending.slice(1) || "txt")}\n${text}\n\`\`\`\`\n`;
  });
  const intro = `# ${file}\n\nA part of the repository, as it is.\n`;
  return `---\nsearch: false\noutline: 2\n---\n\n${[intro, ...folders, "", ...parts].join("\n")}`;
}

function ownPages(folder = "docs") {
  return readdirSync(path.join(repository, folder), { withFileTypes: true }).flatMap((entry) => {
    const file = `${folder}/${entry.name}`;
    if (entry.isDirectory()) return /^(node_modules|scripts|images|\..*)$/.test(entry.name) ? [] : ownPages(file);
    return file.endsWith(".md") ? [file] : [];
  });
}

for (const file of [...ownPages(), ...Object.keys(elsewhere)]) {
  pages.set(pageOf(file), withSiteLinks(readFileSync(path.join(repository, file), "utf8"), file, pageOf(file)));
}
for (const [file, [page, make]] of Object.entries(generated)) {
  pages.set(page, withSiteLinks(await make(repository), file, page));
}
for (const [name, text] of await clientPages(repository)) pages.set(`reference/rrgate-client/${name}`, text);
for (const [name, text] of await cppPages(repository)) pages.set(`reference/cpp/${name}`, text);
for (const file of shown) pages.set(pageOf(file) ?? showPage(file), shownText(file));

rmSync(target, { recursive: true, force: true });
await cp(path.join(repository, "docs/images"), path.join(target, "images"), { recursive: true });
await cp(path.join(repository, "web/public/icon.svg"), path.join(target, "public/icon.svg"));
for (const [page, text] of pages) {
  const file = path.join(target, page);
  await mkdir(path.dirname(file), { recursive: true });
  await writeFile(file, text);
}
console.log(`${pages.size} pages`);
