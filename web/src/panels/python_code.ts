// Values as Python: structures are objects that the service's types make, pods and named arrays are numpy's.
// Layer: web/panels, pure. Source: the documentation of RobotRaconteur's Python module.

import type { Definitions, Struct } from "../values/definitions";
import { itemsOf } from "../values/parse";
import { parseType } from "../values/type_text";

export class PythonCode {
  /** What is to be done before the values are used. */
  readonly lines: string[] = [];
  usesNumpy = false;
  readonly #definitions: Definitions;
  #made = 0;

  constructor(definitions: Definitions) {
    this.#definitions = definitions;
  }

  /** @returns an expression, of names that `lines` give a value. */
  value(value: unknown, type: string, scope: string): string {
    if (value === null || value === undefined) return "None";
    const { base, container, array } = parseType(type);
    const item = type.replace(/\{\w+\}$/, "");
    if (container === "list" && Array.isArray(value))
      return `[${value.map((each) => this.value(each, item, scope)).join(", ")}]`;
    if (value instanceof Map)
      return `{${[...(value as Map<unknown, unknown>)].map(([key, each]) => `${plain(container === "int32" ? Number(key) : key)}: ${this.value(each, item, scope)}`).join(", ")}}`;
    if (base === "varvalue") return varvalue(value);
    const struct = this.#definitions.struct(base, scope);
    if (!struct && array === "multidim") return this.#grid(value);
    if (!struct) return plain(value);
    if (struct.kind === "struct") return this.#structure(value, struct);
    const items = array === "none" ? [value] : Array.isArray(value) ? (value as unknown[]) : [value];
    return this.#numpy(items as object[], struct);
  }

  #structure(value: object, struct: Struct): string {
    const name = this.#name();
    this.lines.push(`${name} = RRN.NewStructure(${plain(struct.name)}, robot)`);
    for (const field of struct.fields) {
      const given = this.value(own(value, field.name), field.type, struct.scope);
      this.lines.push(`${name}.${field.name} = ${given}`);
    }
    return name;
  }

  /** The first dimension varies fastest. */
  #grid(value: object): string {
    this.usesNumpy = true;
    return `numpy.reshape(${plain(own(value, "data"))}, ${plain(own(value, "dims"))}, order="F")`;
  }

  #numpy(items: readonly object[], struct: Struct): string {
    this.usesNumpy = true;
    const name = this.#name();
    const make = struct.kind === "pod" ? "GetPodDType" : "GetNamedArrayDType";
    this.lines.push(`${name} = numpy.zeros((${items.length},), dtype=RRN.${make}(${plain(struct.name)}, robot))`);
    items.forEach((item, i) => this.#fill(`${name}[${i}]`, item, struct));
    return name; // also of one: a numpy array that holds it
  }

  #fill(target: string, value: object, struct: Struct): void {
    for (const field of struct.fields) {
      const given = own(value, field.name);
      const { base, array } = parseType(field.type);
      const inner = this.#definitions.struct(base, struct.scope);
      let at = `${target}[${plain(field.name)}]`;
      if (array === "max") {
        // Room for the most that there may be, and how many there are.
        const { length } = given as ArrayLike<unknown>;
        this.lines.push(`${at}["len"] = ${length}`);
        at += inner ? '["array"]' : `["array"][:${length}]`;
      }
      if (!inner) this.lines.push(`${at} = ${plain(given)}`);
      else if (Array.isArray(given)) given.forEach((each: object, i) => this.#fill(`${at}[${i}]`, each, inner));
      else this.#fill(at, given as object, inner);
    }
  }

  #name(): string {
    return `value${++this.#made}`;
  }
}

/** What says its type with it. */
function varvalue(value: unknown): string {
  const types: Readonly<Record<string, string>> = { string: "string", number: "double", boolean: "bool" };
  const isNumbers = Array.isArray(value) && value.every((each) => typeof each === "number");
  const items = itemsOf(value) ?? (isNumbers ? "double" : undefined);
  const type = items === undefined ? types[typeof value] : `${items}[]`;
  return type === undefined ? plain(value) : `RR.VarValue(${plain(value)}, "${type}")`;
}

function own(value: object, name: string): unknown {
  return Object.hasOwn(value, name) ? (value as Record<string, unknown>)[name] : undefined;
}

function plain(value: unknown): string {
  if (value === null || value === undefined) return "None";
  if (typeof value === "boolean") return value ? "True" : "False";
  if (typeof value === "number" && !Number.isFinite(value)) return `float("${String(value).toLowerCase()}")`;
  if (ArrayBuffer.isView(value) || Array.isArray(value))
    return `[${Array.from(value as ArrayLike<unknown>, plain).join(", ")}]`;
  if (typeof value === "object")
    return `{${Object.entries(value)
      .map(([key, each]) => `${JSON.stringify(key)}: ${plain(each)}`)
      .join(", ")}}`;
  return typeof value === "bigint" ? String(value) : JSON.stringify(value);
}
