// The reference of the configuration, from its JSON schema.
import { readFile } from "node:fs/promises";
import path from "node:path";
import { pathToFileURL } from "node:url";

/**
 * Every option of a schema, in its order. Items of an array stand below `name[]`.
 * @returns {{ path: string, schema: object, isRequired: boolean }[]}
 */
export function listOptions(schema, above = "", root = schema) {
  return Object.entries(schema.properties ?? {}).flatMap(([name, given]) => {
    const option = resolve(given, root);
    const own = { path: above + name, schema: option, isRequired: (schema.required ?? []).includes(name) };
    const items = option.items && resolve(option.items, root);
    return [
      own,
      ...listOptions(option, `${own.path}.`, root),
      ...(items ? listOptions(items, `${own.path}[].`, root) : []),
    ];
  });
}

function resolve(schema, root) {
  if (!schema.$ref) return schema;
  const found = schema.$ref
    .replace("#/", "")
    .split("/")
    .reduce((part, key) => part?.[key], root);
  if (!found) throw new Error(`the schema has no ${schema.$ref}`);
  return { ...found, ...schema };
}

export async function configurationPage(repository) {
  const schema = JSON.parse(await readFile(path.join(repository, "gateway-config/gateway.schema.json"), "utf8"));
  const sections = new Map();
  for (const option of listOptions(schema)) {
    const [section] = option.path.split(/[.[]/);
    sections.set(section, [...(sections.get(section) ?? []), option]);
  }
  return [
    "# Configuration",
    "",
    "All options of the file that `rrgate serve --config FILE` reads: JSON, in which comments are allowed. `rrgate check-config FILE`",
    'says what is wrong with one. With `"$schema": "/usr/share/rrgate/gateway.schema.json"` editors complete and check it. Relative',
    "paths count from the folder of the file. `a[].b` is the option `b` of each entry of the list `a`.",
    "",
    "The smallest file:",
    "",
    "```json",
    (await readFile(path.join(repository, "gateway-config/smallest.json"), "utf8")).trim(),
    "```",
    ...[...sections].flatMap(([name, options]) => [
      "",
      `## ${name}`,
      "",
      "| Option | Type | Default | |",
      "|---|---|---|---|",
      ...options.map(row),
    ]),
    "",
  ].join("\n");
}

function row({ path: name, schema, isRequired }) {
  const examples = (schema.items?.examples ?? schema.examples ?? []).map((each) => code(JSON.stringify(each)));
  const text = [schema.description ?? "", examples.length > 0 ? `Such as ${examples.join(", ")}.` : ""]
    .join(" ")
    .trim();
  return `| ${code(name)} | ${typeOf(schema)} | ${isRequired ? "required" : defaultOf(schema)} | ${cell(text)} |`;
}

function typeOf(schema) {
  if (schema.enum) return schema.enum.map((value) => code(JSON.stringify(value))).join(", ");
  const { minimum, maximum } = schema;
  if (minimum !== undefined && maximum !== undefined) return `${schema.type}, ${minimum} to ${maximum}`;
  if (schema.type === "array") return `list of ${schema.items?.type ?? "value"}s`;
  return schema.type ?? "";
}

function defaultOf(schema) {
  if (schema.default === undefined) return schema.type === "array" ? code("[]") : "";
  return code(JSON.stringify(schema.default));
}

/** Quotes text so that neither tables nor templates of the site read it as theirs. */
export const cell = (text) =>
  text.replaceAll("|", "\\|").replaceAll("<", "&lt;").replaceAll("{{", "&#123;{").replaceAll("\n", " ");
export const code = (text) => `<code v-pre>${cell(text)}</code>`;

// Alone: the options without a description, which is an error of `./dev lint`.
if (process.argv[1] && import.meta.url === pathToFileURL(process.argv[1]).href) {
  const schema = JSON.parse(await readFile(process.argv[2], "utf8"));
  const silent = listOptions(schema).filter(({ schema }) => !schema.description?.trim());
  for (const { path: name } of silent) console.error(`${process.argv[2]}: option ${name} has no description`);
  process.exitCode = silent.length > 0 ? 1 : 0;
}
