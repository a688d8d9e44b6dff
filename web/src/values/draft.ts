// A value while it is typed in: the same shape as its type, with texts where the value has words.
// Layer: web/values, pure. Maps and arrays instead of objects, so that a field may have any name.

import { type ExactValue, rrValue, typeOf } from "rrgate-client";

import type { Definitions } from "./definitions";
import { enumName } from "./definitions";
import { itemsOf, parseInput } from "./parse";
import { isComplex, isNumeric, parseType } from "./type_text";
import type { TypeText } from "./type_text";

export type Draft =
  /** `was`: what the device had, where it was read; it may have what no text says. */
  | { kind: "text"; text: string; was?: unknown }
  /** In the order of the definition; null where the whole struct is. */
  | { kind: "struct"; fields: Map<string, Draft> | null }
  /** `isNull`: there was none on the device; until something is added. */
  | { kind: "list"; items: Draft[]; isNull?: true }
  | { kind: "map"; entries: { key: string; value: Draft }[]; isNull?: true };

/** What a type looks like to who types it in. */
export type Shape =
  | { kind: "text"; type: string }
  | { kind: "bool" }
  | { kind: "uuid" }
  | { kind: "enum"; names: readonly string[] }
  | {
      kind: "struct";
      name: string;
      scope: string;
      fields: readonly { name: string; type: string; documentation: string }[];
    }
  | { kind: "list"; item: string }
  | { kind: "map"; keys: "int32" | "string"; item: string };

const MOST_DEPTH = 8; // a struct may contain itself, by a list

export function shapeOf(type: string, definitions: Definitions, scope: string): Shape {
  const parsed = parseType(type);
  if (parsed.container === "list" || parsed.container === "generator") return { kind: "list", item: bare(parsed) };
  if (parsed.container !== "none") return { kind: "map", keys: parsed.container, item: bare(parsed) };
  if (parsed.base === "bool" && parsed.array === "none") return { kind: "bool" };
  const struct = isWord(parsed.base) ? undefined : definitions.struct(parsed.base, scope);
  if (struct && parsed.array === "none") {
    if (struct.name === "com.robotraconteur.uuid.UUID") return { kind: "uuid" };
    return { kind: "struct", name: struct.name, scope: struct.scope, fields: struct.fields };
  }
  if (struct && parsed.array !== "multidim") return { kind: "list", item: parsed.base };
  const names = definitions.enum(parsed.base, scope);
  if (names && parsed.array === "none") return { kind: "enum", names: [...names.values.keys()] };
  return { kind: "text", type };
}

/** All that the shape of a type's drafts depends on: where it is the same, a draft still fits. */
export function shapeText(type: string, definitions: Definitions, scope: string, seen = new Set<string>()): string {
  const shape = shapeOf(type, definitions, scope);
  const inner = (of: string, within: string): string => shapeText(of, definitions, within, seen);
  if (shape.kind === "list" || shape.kind === "map") return `${type} of ${inner(shape.item, scope)}`;
  if (shape.kind === "enum") return `${type} ${shape.names.join(" ")}`;
  if (shape.kind !== "struct" || seen.has(shape.name)) return `${shape.kind} ${type}`;
  seen.add(shape.name); // it may contain itself
  return `${shape.name} {${shape.fields.map((field) => `${field.name} ${inner(field.type, shape.scope)}`).join(", ")}}`;
}

/** An empty value. */
export function makeDraft(type: string, definitions: Definitions, scope: string, depth = 0): Draft {
  const shape = shapeOf(type, definitions, scope);
  switch (shape.kind) {
    case "struct":
      return {
        kind: "struct",
        fields:
          depth >= MOST_DEPTH
            ? null
            : new Map(
                shape.fields.map(({ name, type: of }) => [name, makeDraft(of, definitions, shape.scope, depth + 1)]),
              ),
      };
    case "list":
      return { kind: "list", items: [] };
    case "map":
      return { kind: "map", entries: [] };
    case "enum":
      return { kind: "text", text: shape.names[0] ?? "" };
    case "bool":
      return { kind: "text", text: "false" };
    case "uuid":
    case "text":
      return { kind: "text", text: emptyText(type) };
  }
}

/** @throws Error with the path to what is wrong, what was found and what was expected. */
export function valueOf(draft: Draft, type: string, definitions: Definitions, scope: string): unknown {
  const shape = shapeOf(type, definitions, scope);
  if (shape.kind === "struct" && draft.kind === "struct") {
    if (draft.fields === null) return null;
    const value = Object.create(null) as Record<string, unknown>;
    for (const { name, type: of } of shape.fields) {
      const field = draft.fields.get(name) ?? makeDraft(of, definitions, shape.scope);
      value[name] = at(name, () => valueOf(field, of, definitions, shape.scope));
    }
    return value;
  }
  if ((draft.kind === "list" || draft.kind === "map") && draft.isNull) return null;
  if (shape.kind === "list" && draft.kind === "list")
    return draft.items.map((item, i) => at(`[${i}]`, () => valueOf(item, shape.item, definitions, scope)));
  if (shape.kind === "map" && draft.kind === "map") {
    const made = new Map<string | number, unknown>();
    for (const { key: typed, value } of draft.entries) {
      const key = shape.keys === "string" ? typed : (at("key", () => parseInput(typed, "int32")) as number);
      if (made.has(key)) throw new Error(`key "${typed}" stands twice`);
      made.set(
        key,
        at(typed, () => valueOf(value, shape.item, definitions, scope)),
      );
    }
    return made;
  }
  if (draft.kind !== "text") throw new Error(`found a ${draft.kind}, expected ${type}`);
  if (draft.was !== undefined && textOf(draft.was) === draft.text) return draft.was;
  if (shape.kind === "uuid") return { ["uuid_bytes"]: readUuid(draft.text) };
  if (shape.kind === "enum") return enumValue(draft.text, type, definitions, scope);
  if (type === "varvalue") return varvalueOf(draft.text, draft.was);
  return parseInput(draft.text, type);
}

/** A value of the device, to be changed and sent back. */
export function draftOf(value: unknown, type: string, definitions: Definitions, scope: string): Draft {
  const shape = shapeOf(type, definitions, scope);
  if (shape.kind === "struct") {
    if (value === null || typeof value !== "object") return { kind: "struct", fields: null };
    const of = value as Record<string, unknown>;
    return {
      kind: "struct",
      fields: new Map(shape.fields.map((f) => [f.name, draftOf(of[f.name], f.type, definitions, shape.scope)])),
    };
  }
  if (shape.kind === "list")
    return {
      kind: "list",
      items: Array.isArray(value) ? value.map((item) => draftOf(item, shape.item, definitions, scope)) : [],
      ...(value === null && { isNull: true }),
    };
  if (shape.kind === "map")
    return {
      kind: "map",
      entries:
        value instanceof Map
          ? [...value].map(([key, item]) => ({
              key: String(key),
              value: draftOf(item, shape.item, definitions, scope),
            }))
          : [],
      ...(value === null && { isNull: true }),
    };
  if (shape.kind === "uuid") return { kind: "text", text: formatUuid(uuidBytes(value)) };
  if (shape.kind === "enum") {
    const found = definitions.enum(parseType(type).base, scope);
    return { kind: "text", text: (found && enumName(value, found)) ?? String(value) };
  }
  return { kind: "text", text: textOf(value), was: value };
}

/** The first key that no entry of a map has. */
export function freeKey(entries: readonly { key: string }[], keys: "int32" | "string"): string {
  const taken = new Set(entries.map(({ key }) => (keys === "int32" ? String(Number(key)) : key)));
  const [first, before] = keys === "int32" ? [0, ""] : [1, "key"];
  for (let number = first; ; ++number) if (!taken.has(`${before}${number}`)) return `${before}${number}`;
}

/** As JSON of the gateway's HTTP API, for examples of code. 64-bit integers, and numbers that JSON has not, are texts there. */
export function jsonOf(value: unknown): unknown {
  if (typeof value === "bigint" || (typeof value === "number" && !Number.isFinite(value))) return String(value);
  if (ArrayBuffer.isView(value)) return Array.from(value as unknown as ArrayLike<number | bigint>, jsonOf);
  if (Array.isArray(value)) return value.map(jsonOf);
  if (value instanceof Map) return objectOf([...value].map(([key, item]) => [String(key), jsonOf(item)]));
  if (value !== null && typeof value === "object")
    return objectOf(Object.entries(value).map(([key, item]) => [key, jsonOf(item)]));
  return value;
}

function objectOf(entries: readonly (readonly [string, unknown])[]): object {
  const made = Object.create(null) as Record<string, unknown>;
  for (const [key, value] of entries) made[key] = value;
  return made;
}

function enumValue(text: string, type: string, definitions: Definitions, scope: string): number {
  const found = definitions.enum(parseType(type).base, scope)?.values;
  const value = found?.get(text.trim());
  if (value !== undefined) return value;
  if (/^-?\d+$/.test(text.trim())) return Number(text);
  throw new Error(`"${text}" is no ${type}; expected one of ${[...(found?.keys() ?? [])].slice(0, 8).join(", ")}`);
}

export function readUuid(text: string): Uint8Array {
  const digits = text
    .trim()
    .replaceAll("-", "")
    .replace(/^\{|\}$/g, "");
  if (digits === "") return new Uint8Array(16);
  if (!/^[0-9a-f]{32}$/i.test(digits))
    throw new Error(
      `"${text}" is no UUID; expected 32 hexadecimal digits such as 39b513e7-21b9-4b49-8654-7537473030eb`,
    );
  return Uint8Array.from({ length: 16 }, (_, i) => Number.parseInt(digits.slice(2 * i, 2 * i + 2), 16));
}

/** Of a com.robotraconteur.uuid.UUID. */
export function uuidBytes(value: unknown): unknown {
  return (value as Record<string, unknown> | null)?.["uuid_bytes"];
}

export function formatUuid(bytes: unknown): string {
  if (!(bytes instanceof Uint8Array) || bytes.length !== 16) return "";
  const digits = Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
  return digits.replace(/^(.{8})(.{4})(.{4})(.{4})/, "$1-$2-$3-$4-");
}

/** What `exact` has made: a structure may have the same fields. */
const exactValues = new WeakSet<object>();

function exact(type: string, value: unknown): ExactValue {
  const made = rrValue(type, value);
  exactValues.add(made);
  return made;
}

/** The named type that a varvalue has to be sent as, and its value; undefined where the value says all. */
export function namedOf(value: unknown): ExactValue | undefined {
  if (typeof value === "object" && value !== null && exactValues.has(value)) return value as ExactValue;
  const type = typeOf(value);
  return type === undefined ? undefined : { type, value };
}

/** It stays of the type that the device had, where that can be told; else it is JSON, or a text. */
function varvalueOf(text: string, was: unknown): unknown {
  if (typeof was === "string") return text;
  if (text.trim() === "") return null;
  const items = itemsOf(was);
  // A whole number that is read may have been any: nothing says that it has to be whole.
  const isFraction = items?.includes("int") === true && /\d\.\d|\de/i.test(text);
  if (items !== undefined) return parseInput(text, isFraction ? "double[]" : `${items}[]`);
  const named = typeOf(was);
  if (named !== undefined) return exact(named, parseInput(text, named));
  if (was instanceof Map)
    return parseInput(text, [...was.keys()].some(Number.isInteger) ? "varvalue{int32}" : "varvalue{string}");
  const cells = itemsOf((was as { data?: unknown } | null | undefined)?.data);
  if (cells !== undefined) return parseInput(text, `${cells}[*]`);
  try {
    return JSON.parse(text);
  } catch {
    return text;
  }
}

function at<T>(where: string, make: () => T): T {
  try {
    return make();
  } catch (error) {
    const text = (error as Error).message;
    throw new Error(`${where}${text.startsWith("[") ? "" : ": "}${text}`, { cause: error });
  }
}

function isWord(base: string): boolean {
  return isNumeric(base) || isComplex(base) || base === "string" || base === "varvalue" || base === "varobject";
}

/** The type of one element of a list or map. */
function bare(type: TypeText): string {
  const sizes = type.sizes.join(",");
  const brackets = {
    none: "",
    any: "[]",
    fixed: `[${sizes}]`,
    max: `[${sizes}-]`,
    multidim: sizes ? `[${sizes}]` : "[*]",
  };
  return type.base + brackets[type.array];
}

function emptyText(type: string): string {
  const { base, array, sizes } = parseType(type);
  if (!isNumeric(base) || isComplex(base)) return "";
  if (array === "none") return "0";
  return array === "fixed"
    ? Array(sizes[0] ?? 0)
        .fill("0")
        .join(", ")
    : "";
}

function textOf(value: unknown): string {
  if (value === null || value === undefined) return "";
  if (ArrayBuffer.isView(value)) return Array.from(value as unknown as ArrayLike<number>).join(", ");
  const json = jsonOf(value);
  return typeof json === "string" ? json : JSON.stringify(json);
}
