// The reference of the C++ API, by Doxygen from its headers: a page for each header that programs include.
import { execFileSync } from "node:child_process";
import { mkdtemp, readFile, readdir, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import path from "node:path";

/** What a program that includes a header writes down, by the files of the repository that declare it. */
const headers = {
  device: [
    "node/service/node.hpp",
    "node/service/service.hpp",
    "node/service/caller.hpp",
    "node/service/generator.hpp",
    "node/service/memory.hpp",
    "node/service/memory_buffer.hpp",
    "node/service/pipe_endpoint.hpp",
    "node/service/password_file.hpp",
    "node/tls/certificate_files.hpp",
  ],
  client: [
    "node/client/client.hpp",
    "node/client/client_connection.hpp",
    "node/client/async_object.hpp",
    "node/client/remote_generator.hpp",
    "node/client/remote_memory.hpp",
    "core/session/url.hpp",
  ],
  subscribe: [
    "node/subscribe/service_subscription.hpp",
    "node/subscribe/service_subscription_filter.hpp",
    "node/subscribe/subscribe_service_by_type.hpp",
    "node/subscribe/member_subscription.hpp",
    "node/discovery/discovery.hpp",
    "node/discovery/service_query.hpp",
  ],
  gateway: ["server/gateway/embedded_gateway.hpp"],
  beast: ["node/transport/beast_stream.hpp"],
  values: ["core/types/value.hpp", "core/support/error.hpp", "core/support/node_id.hpp"],
};

const entities = { lt: "<", gt: ">", amp: "&", quot: '"', apos: "'" };
const decode = (text) => text.replace(/&(\w+);/g, (whole, name) => entities[name] ?? whole);
/** Text of XML; code in backticks. */
const plain = (xml = "") =>
  decode(
    xml
      .replace(/<computeroutput>(.*?)<\/computeroutput>/gs, (_, code) => `\`${code.replace(/<[^>]*>/g, "")}\``)
      .replace(/<\/(para|listitem)>/g, "\n")
      .replace(/<[^>]*>/g, ""),
  )
    .replace(/[ \t]+/g, " ")
    .trim();
/** Of a page: nothing in it is taken for a tag or an expression of Vue. */
const prose = (text) =>
  text
    .split(/(`[^`]*`)/)
    .map((part, i) => (i % 2 ? part : part.replace(/</g, "&lt;").replace(/\{\{/g, "&#123;&#123;")))
    .join("")
    .replace(/(^|[.:;)\]`] )(Returns|Errors|Throws|Source) /g, (_, before, word) => `${before.trimEnd()}\n\n*${word}* `)
    .trim();
const part = (xml, tag) => new RegExp(`<${tag}[^>]*>(.*?)</${tag}>`, "s").exec(xml)?.[1];
const parts = (xml, tag) => [...xml.matchAll(new RegExp(`<${tag}\\b[^>]*>.*?</${tag}>`, "gs"))].map(([whole]) => whole);
const documentation = (xml) =>
  prose(plain(`${part(xml, "briefdescription") ?? ""}\n${part(xml, "detaileddescription") ?? ""}`));

function declaration(member) {
  const kind = /kind="(\w+)"/.exec(member)[1];
  const list = part(member, "templateparamlist");
  const of = (xml, ...tags) =>
    tags
      .map((tag) => plain(part(xml, tag)))
      .filter(Boolean)
      .join(" ");
  const template = list
    ? `template <${parts(list, "param")
        .map((each) => of(each, "type", "declname"))
        .join(", ")}>\n`
    : "";
  const own = member.replace(/<(templateparamlist|param)>.*?<\/\1>/gs, "");
  const values = parts(own, "enumvalue").map((each) => of(each, "name"));
  const name = of(own.replace(/<enumvalue.*<\/enumvalue>/s, ""), "name");
  const text =
    kind === "enum"
      ? `enum ${/strong="yes"/.test(own) ? "class " : ""}${name} { ${values.join(", ")} }`
      : kind === "typedef"
        ? `using ${name} = ${of(own, "type")}`
        : `${/ static="yes"/.test(own) ? "static " : ""}${of(own, "type", "name")}${of(own, "argsstring")}${kind === "variable" ? ` ${of(own, "initializer")}` : ""}`;
  return `${template}${text
    .replace(/< /g, "<")
    .replace(/ >/g, ">")
    .replace(/ ([&*]+) /g, "$1 ")
    .replace(/ ([&*]+)(?=\w)/g, "$1 ")
    .trim()};`;
}

/** Heading of its own where it is not of a class. */
function memberText(member) {
  const told = documentation(member);
  return `\`\`\`cpp\n${declaration(member)}\n\`\`\`\n${told ? `\n${told}\n` : ""}`;
}

const sections = (xml) =>
  parts(xml, "sectiondef")
    .filter((each) =>
      /kind="(public-(type|static-func|func|attrib|static-attrib)|func|typedef|enum|var|user-defined)"/.test(
        each.slice(0, 60),
      ),
    )
    .flatMap((each) =>
      parts(each, "memberdef").filter((member) => !/prot="(private|protected)"/.test(member.slice(0, 200))),
    );

function classText(xml) {
  const name = plain(part(xml, "compoundname")).replace(/^(rr|rrgate)::/, "");
  const kind = /<compounddef[^>]* kind="(\w+)"/.exec(xml)[1];
  const own = xml.replace(/<sectiondef.*<\/sectiondef>/s, "");
  const members = sections(xml).filter((member) => !/<name>(operator=|~)/.test(member));
  return `## ${kind} ${name}\n\n${documentation(own)}\n\n${members.map(memberText).join("\n")}`;
}

async function readXml(repository, files, out) {
  const options = {
    INPUT: files.map((file) => `"${path.join(repository, file)}"`).join(" "),
    OUTPUT_DIRECTORY: `"${out}"`,
    STRIP_FROM_PATH: `"${repository}"`,
    GENERATE_HTML: "NO",
    GENERATE_LATEX: "NO",
    GENERATE_XML: "YES",
    XML_PROGRAMLISTING: "NO",
    EXTRACT_ALL: "YES",
    MARKDOWN_SUPPORT: "YES",
    AUTOLINK_SUPPORT: "NO",
    QUIET: "YES",
    WARNINGS: "NO",
    HIDE_UNDOC_CLASSES: "NO",
    ENABLE_PREPROCESSING: "NO",
  };
  await writeFile(
    path.join(out, "Doxyfile"),
    Object.entries(options)
      .map(([key, value]) => `${key} = ${value}\n`)
      .join(""),
  );
  execFileSync("doxygen", [path.join(out, "Doxyfile")], { stdio: ["ignore", "ignore", "inherit"] });
  const names = (await readdir(path.join(out, "xml"))).filter((name) => /^(class|struct|namespace)/.test(name)).sort();
  return Promise.all(names.map((name) => readFile(path.join(out, "xml", name), "utf8")));
}

/** @returns {Promise<[string, string][]>} names and texts of its pages */
export async function cppPages(repository) {
  const out = await mkdtemp(path.join(tmpdir(), "rrgate-docs-"));
  try {
    const compounds = (await readXml(repository, Object.values(headers).flat(), out)).filter(
      (xml) => !/detail|@\d/.test(part(xml, "compoundname")),
    );
    const pages = Object.entries(headers).map(([name, files]) => {
      const isOf = (xml) => files.some((file) => xml.includes(`file="${file}"`));
      const classes = compounds.filter(
        (xml) => !/ kind="namespace"/.test(xml) && isOf(/.*(<location [^>]*>)/s.exec(xml)[1]),
      );
      const functions = compounds
        .filter((xml) => / kind="namespace"/.test(xml))
        .flatMap(sections)
        .filter(isOf);
      if (classes.length + functions.length === 0) throw new Error(`Doxygen finds nothing of ${files.join(", ")}`);
      const title =
        name === "values"
          ? "# Values and errors\n\nWhat the headers of `rrgate/` have in common."
          : `# rrgate/${name}.hpp`;
      const free = functions.length ? `## Functions and types\n\n${functions.map(memberText).join("\n")}\n` : "";
      return [`${name}.md`, `---\noutline: 2\n---\n\n${title}\n\n${free}${classes.map(classText).join("\n")}`];
    });
    const links = pages.map(
      ([name]) =>
        `- [${name === "values.md" ? "Values and errors" : `rrgate/${name.replace(".md", ".hpp")}`}](${name})`,
    );
    const intro =
      "# The C++ API\n\nFrom the headers, by Doxygen. [Devices in C++](../../device-author.md), [subscriptions](../../subscriptions.md) and";
    return [
      ...pages,
      [
        "index.md",
        `${intro}\n[libraries in a program](../../embedding.md) tell how they are used.\n\n${links.join("\n")}\n`,
      ],
    ];
  } finally {
    await rm(out, { recursive: true });
  }
}
