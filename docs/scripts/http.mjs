// The reference of the gateway's own HTTP interface, from the OpenAPI document that it serves.
import { readFile } from "node:fs/promises";
import path from "node:path";
import { cell, code } from "./configuration.mjs";

export async function httpPage(repository) {
  const file = path.join(repository, "server/http/endpoints/gateway_openapi.json");
  const document = JSON.parse(await readFile(file, "utf8"));
  const find = (value) =>
    value?.$ref
      ? value.$ref
          .replace("#/", "")
          .split("/")
          .reduce((part, key) => part[key], document)
      : value;
  const operations = Object.entries(document.paths).flatMap(([route, item]) =>
    Object.entries(item)
      .filter(([method]) => method !== "parameters")
      .map(([method, operation]) => operationText(method, route, operation, item.parameters ?? [], find)),
  );
  const schemas = Object.entries(document.components.schemas).map(([name, schema]) => schemaText(name, schema));
  return [
    "# HTTP of the gateway",
    "",
    `${cell(document.info.description)} The gateway serves this as a document at \`/api/v1/openapi.json\`.`,
    "[Devices over HTTP](../../../docs/http-api.md) tells how objects of devices are used.",
    "",
    ...operations,
    "## Forms",
    "",
    ...schemas,
  ].join("\n");
}

function operationText(method, route, operation, shared, find) {
  const parameters = [...shared, ...(operation.parameters ?? [])].map(find);
  const body = find(operation.requestBody)?.content?.["application/json"]?.schema;
  const lines = [
    `## <code v-pre>${method.toUpperCase()} ${route}</code> {#${operation.operationId}}`,
    "",
    cell(operation.summary),
    "",
  ];
  if (operation.description) lines.push(cell(operation.description), "");
  if (parameters.length > 0) {
    lines.push("| Parameter | In | |", "|---|---|---|");
    for (const { name, in: where, description = "" } of parameters)
      lines.push(`| ${code(name)} | ${where} | ${cell(description)} |`);
    lines.push("");
  }
  if (body) lines.push(`Body: ${formOf(body)}`, "");
  lines.push("| Status | | Body |", "|---|---|---|");
  for (const [status, given] of Object.entries(operation.responses)) {
    const { description = "", content = {} } = find(given);
    const forms = Object.entries(content).map(([type, { schema }]) => `${code(type)}: ${formOf(schema)}`);
    lines.push(`| ${status} | ${cell(description)} | ${forms.join("<br>")} |`);
  }
  return [...lines, ""].join("\n");
}

function schemaText(name, schema) {
  const lines = [`### ${name}`, ""];
  if (schema.description) lines.push(cell(schema.description), "");
  if (!schema.properties) return [...lines, formOf(schema), ""].join("\n");
  lines.push("| Field | Type | |", "|---|---|---|");
  for (const [field, given] of Object.entries(schema.properties)) {
    const optional = (schema.required ?? []).includes(field) ? "" : ", optional";
    lines.push(`| ${code(field)} | ${formOf(given)}${optional} | ${cell(given.description ?? "")} |`);
  }
  return [...lines, ""].join("\n");
}

function formOf(schema) {
  if (!schema) return "";
  if (schema.$ref) {
    const name = schema.$ref.split("/").at(-1);
    return `[${name}](#${name.toLowerCase()})`;
  }
  if (schema.const !== undefined) return code(JSON.stringify(schema.const));
  if (schema.enum) return schema.enum.map((value) => code(JSON.stringify(value))).join(", ");
  const choices = schema.oneOf ?? schema.anyOf ?? schema.allOf;
  if (choices) return choices.map(formOf).join(" or ");
  if (schema.type === "array") return `list of ${formOf(schema.items)}`;
  if (schema.properties) {
    const fields = Object.entries(schema.properties).map(([name, form]) => `${code(name)}: ${formOf(form)}`);
    return `object with ${fields.join(", ")}`;
  }
  return [schema.type ?? "any"].flat().join(" or ");
}
