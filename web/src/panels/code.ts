// What a form does, as code: for a page, a shell, and a Python program.
// Layer: web/panels, pure. Names and values are quoted: they come from the device.

import { parseStep, splitSteps } from "../app/router";
import type { Member } from "../robot/remote";
import type { Definitions } from "../values/definitions";
import { jsonOf, namedOf } from "../values/draft";
import { inputsOf } from "./panel";
import { PythonCode } from "./python_code";

export type CodeLanguage = "JavaScript" | "curl" | "Python";

export interface CodePlace {
  device: string;
  service: string;
  /** "" for the root, else "Webcams[0]". */
  object: string;
}

/** What the types of the member's values are named in. */
export interface Types {
  definitions: Definitions;
  scope: string;
}

/** `base`: of the gateway, with a slash at its end. */
export function asCode(
  language: CodeLanguage,
  base: string,
  place: CodePlace,
  member: Member,
  values: readonly unknown[],
  types: Types,
): string {
  if (language === "curl") return curl(base, place, member, values);
  const url = `${base.replace(/^http/, "ws")}devices/${encodeURIComponent(place.device)}?service=${encodeURIComponent(place.service)}`;
  return language === "Python" ? python(url, place, member, values, types) : javaScript(url, place, member, values);
}

function javaScript(url: string, { object }: CodePlace, member: Member, values: readonly unknown[]): string {
  const args = values.map(literal).join(", ");
  const verb = { function: "", property: ".set", wire: ".poke" }[member.kind as "function" | "property" | "wire"];
  const found = object === "" ? "" : `const object = await robot.$.find(${JSON.stringify(`*.${object}`)});\n`;
  return [
    `import { ${args.includes("rrValue(") ? "connect, rrValue" : "connect"} } from "rrgate-client";`,
    `const robot = await connect(${JSON.stringify(url)});`,
    `${found}console.log(await ${object === "" ? "robot" : "object"}.$.member(${JSON.stringify(member.name)})${verb}(${args}));`,
  ].join("\n");
}

/** Nothing is rounded: `123n`, `NaN`. Keys are quoted and computed: `__proto__` is a name like others. */
function literal(value: unknown): string {
  if (typeof value === "bigint") return `${value}n`;
  if (typeof value === "number") return String(value);
  const named = namedOf(value);
  if (named) return `rrValue(${JSON.stringify(named.type)}, ${plainLiteral(named.value)})`;
  return plainLiteral(value);
}

function plainLiteral(value: unknown): string {
  if (ArrayBuffer.isView(value)) return literal(Array.from(value as unknown as ArrayLike<unknown>));
  if (Array.isArray(value)) return `[${value.map(literal).join(", ")}]`;
  if (value instanceof Map)
    return `new Map([${[...value].map(([key, item]) => `[${literal(key)}, ${literal(item)}]`).join(", ")}])`;
  if (value === null || typeof value !== "object") return JSON.stringify(value) ?? "null";
  return `{ ${Object.entries(value)
    .map(([key, item]) => `${key === "__proto__" ? `["__proto__"]` : JSON.stringify(key)}: ${literal(item)}`)
    .join(", ")} }`;
}

function curl(base: string, place: CodePlace, member: Member, values: readonly unknown[]): string {
  const steps = [place.device, place.service, ...httpSteps(place.object), member.name].map(encodeURIComponent);
  const isCall = member.kind === "function";
  const named = Object.create(null) as Record<string, unknown>;
  member.parameters.forEach(({ name }, i) => (named[name] = jsonOf(values[i])));
  const body = JSON.stringify(isCall ? named : jsonOf(values[0]));
  return `curl -X ${isCall ? "POST" : "PUT"} ${shell(`${base}api/v1/devices/${steps.join("/")}`)} \\\n  -H 'Content-Type: application/json' -d ${shell(body)}`;
}

function python(
  url: string,
  { object }: CodePlace,
  member: Member,
  values: readonly unknown[],
  { definitions, scope }: Types,
): string {
  const code = new PythonCode(definitions);
  const inputs = inputsOf(member);
  const args = values.map((value, i) => code.value(value, inputs[i]?.type ?? "varvalue", scope)).join(", ");
  const target = splitSteps(object)
    .map(parseStep)
    .reduce((at, { member: step, index }) => {
      const key = index === null ? "" : /^\d+$/.test(index) ? index : JSON.stringify(index);
      return `${at}.get_${step}(${key})`;
    }, "robot");
  const done =
    member.kind === "function"
      ? `print(${target}.${member.name}(${args}))`
      : member.kind === "property"
        ? `${target}.${member.name} = ${args}`
        : `${target}.${member.name}.PokeOutValue(${args})`;
  return [
    "from RobotRaconteur.Client import *",
    ...(code.usesNumpy ? ["import numpy"] : []),
    `robot = RRN.ConnectService(${JSON.stringify(`rr+${url}`)})`,
    ...code.lines,
    done,
  ].join("\n");
}

/** "Webcams[0].lens" as steps of a URL: Webcams, 0, lens. */
function httpSteps(object: string): string[] {
  return splitSteps(object)
    .map(parseStep)
    .flatMap(({ member, index }) => (index === null ? [member] : [member, index]));
}

function shell(text: string): string {
  return `'${text.replaceAll("'", `'\\''`)}'`;
}
