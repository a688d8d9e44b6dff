// The site: every page of the folder pages/ (scripts/stage.mjs) as a file in build/docs, which the gateway serves at /docs/.
// Nothing is loaded from elsewhere, and no script or style stands inside of a page: the gateway's policy forbids both.
import { createHash } from "node:crypto";
import { existsSync, mkdirSync, readdirSync, readFileSync, writeFileSync } from "node:fs";
import path from "node:path";
import { fileURLToPath } from "node:url";
import { defineConfig } from "vitepress";
import { licences } from "../../cmake/notices.mjs";
import { StyleClasses } from "./style_classes.mjs";
import { makeSidebar } from "./navigation.mjs";

const base = "/docs/";
const build = fileURLToPath(new URL("../../build/", import.meta.url));
const pages = fileURLToPath(new URL("pages/", import.meta.url));
const site = path.join(build, "docs");
const styles = new StyleClasses();

const titleOf = (page) => /^# (.*)$/m.exec(readFileSync(path.join(pages, page), "utf8"))[1];
const decisions = readdirSync(path.join(pages, "adr"))
  .sort()
  .map((name) => [titleOf(`adr/${name}`), `/adr/${name.slice(0, -3)}`]);
const sidebar = makeSidebar(decisions);
for (const { link, text } of sidebar.flatMap((group) => group.items))
  if (!existsSync(path.join(pages, link === "/" ? "index.md" : `${link.replace(/\/$/, "/index")}.md`)))
    throw new Error(`navigation: "${text}" leads to ${link}, which is no page`);

const links = new Set(sidebar.flatMap((group) => group.items.map(({ link }) => link)));
for (const page of readdirSync(pages, { recursive: true }).filter((name) => name.endsWith(".md"))) {
  const link = `/${page.slice(0, -3).replace(/(^|\/)index$/, "$1")}`;
  const isBeside = /^\/(source|reference\/(rrgate-client|cpp))\/|^\/(paper|code-of-conduct)$/.test(link);
  if (!isBeside && !links.has(link)) throw new Error(`navigation: ${page} is missing in navigation.mjs`);
}

/** Anchors as GitHub makes them, so that links work in both places. */
const slugify = (heading) =>
  heading
    .trim()
    .toLowerCase()
    .replace(/[^\p{L}\p{N}_\- ]/gu, "")
    .replaceAll(" ", "-");

/** Puts what scripts and styles a page has inside into files of their own, named by their content. The two styles that the
 * theme gives to elements are one in theme/style.css, and one that is set again when the page runs. */
function withoutInline(html) {
  return html
    .replace(/ style="(position:relative;|--vp-vh:0px;)"/g, "")
    .replace(/<(script|style)([^>]*)>([^<]+(?:<(?!\/\1)[^<]*)*)<\/\1>/g, (whole, tag, attributes, text) => {
      if (/\bsrc=/.test(attributes)) return whole;
      const name = `assets/inline-${createHash("sha256").update(text).digest("hex").slice(0, 8)}.${tag === "script" ? "js" : "css"}`;
      mkdirSync(path.join(site, "assets"), { recursive: true });
      writeFileSync(path.join(site, name), text);
      return tag === "script"
        ? `<script${attributes} src="${base}${name}"></script>`
        : `<link rel="stylesheet" href="${base}${name}">`;
    });
}

/** Columns of tables are aligned by classes (theme/style.css) instead of styles. */
function alignByClass(markdown) {
  for (const rule of ["th_open", "td_open"])
    markdown.renderer.rules[rule] = (tokens, index, options, _environment, renderer) => {
      const token = tokens[index];
      const aligned = /^text-align:(\w+)$/.exec(token.attrGet("style") ?? "");
      if (aligned)
        token.attrs = [...token.attrs.filter(([name]) => name !== "style"), ["class", `align-${aligned[1]}`]];
      return renderer.renderToken(tokens, index, options);
    };
}

export default defineConfig({
  title: "rrgate",
  description: "A gateway between Robot Raconteur devices and the web",
  lang: "en",
  base,
  srcDir: ".vitepress/pages",
  outDir: site,
  cacheDir: path.join(build, "docs-cache"),
  metaChunk: true,
  buildConcurrency: 1, // pages enter the index of the search one after another, in the same order each time
  appearance: { disableTransition: false }, // which takes a style inside of the page
  head: [
    ["link", { rel: "icon", href: `${base}icon.svg` }],
    ["link", { rel: "stylesheet", href: `${base}code.css` }],
  ],
  markdown: { codeTransformers: [styles.transformer()], anchor: { slugify }, config: alignByClass },
  themeConfig: {
    sidebar,
    outline: [2, 3],
    search: { provider: "local" },
  },
  vite: { build: { assetsInlineLimit: 0 }, plugins: [licences()] },
  transformHtml: withoutInline,
  buildEnd: () => writeFileSync(path.join(site, "code.css"), styles.css()),
});
