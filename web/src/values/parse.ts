// Turns what a person typed into the value that a member of a given type takes.
// Layer: web/values, pure. Named types (struct, enum, pod) are typed in as JSON; their definition is checked by the client.

import { INTEGER_RANGES, isComplex, isFloat, isInteger, isNumeric, isWideInteger, parseType } from "./type_text";
import type { TypeText } from "./type_text";

/**
 * Scalars are typed plainly (`12`, `0x1f`, `-1.5e3`, `true`), strings as they are, numeric arrays as `1, 2, 3` or JSON,
 * everything else as JSON.
 * @throws Error with what was found and what was expected.
 */
export function parseInput(text: string, typeText: string): unknown {
  const type = parseType(typeText);
  if (type.container === "none" && type.array === "none") {
    if (type.base === "string") return text;
    if (isNumeric(type.base) && !isComplex(type.base)) return scalar(text.trim(), type.base);
  }
  const source = text.trim();
  if (source === "") {
    if (type.container === "none" && (type.array === "any" || type.array === "max") && isNumeric(type.base)) {
      return typedArray([], type);
    }
    throw new Error(`nothing given; expected ${describe(typeText, type)}`);
  }
  if (type.container === "none" && type.array !== "none" && type.array !== "multidim" && isNumeric(type.base)) {
    if (!source.startsWith("[")) return typedArray(source.split(/[\s,;]+/).filter(Boolean), type);
  }
  return convert(readJson(source, typeText, type), type);
}

/** An example of what to type, shown in an empty field. */
export function placeholder(typeText: string): string {
  const type = parseType(typeText);
  if (type.container === "list") return "[…]";
  if (type.container !== "none") return type.container === "int32" ? '{"0": …}' : '{"key": …}';
  if (type.array === "multidim") return '{"dims": [2, 2], "data": [1, 2, 3, 4]}';
  if (type.array !== "none") return isNumeric(type.base) ? "1, 2, 3" : "[…]";
  if (type.base === "string") return "text";
  if (isComplex(type.base)) return "[re, im]";
  if (isFloat(type.base)) return "0.0";
  if (isInteger(type.base)) return "0";
  return '{"field": …} or a number';
}

function describe(text: string, type: TypeText): string {
  return `${text}, such as ${placeholder(text).replace("…", type.base === "string" ? '"text"' : "1")}`;
}

function readJson(source: string, text: string, type: TypeText): unknown {
  try {
    // A 64-bit integer beyond 2^53 would be rounded by JSON.parse: quote long bare integers, `scalar` reads strings.
    return JSON.parse(isWideInteger(type.base) ? source.replace(/(?<![\w".])-?\d{16,}(?![\w".])/g, '"$&"') : source);
  } catch {
    throw new Error(`${quote(source)} is not valid JSON; expected ${describe(text, type)}`);
  }
}

function convert(json: unknown, type: TypeText): unknown {
  if (json === null) return null;
  const element: TypeText = { ...type, container: "none" };
  if (type.container === "list" || type.container === "generator") {
    if (!Array.isArray(json)) throw new Error(`found ${kindOf(json)}, expected a list [ … ]`);
    return json.map((item) => convert(item, element));
  }
  if (type.container === "string" || type.container === "int32") return convertMap(json, element, type.container);
  if (type.array === "multidim" && isNumeric(type.base)) return multidim(json, type);
  if (type.array !== "none" && isNumeric(type.base)) {
    if (!Array.isArray(json)) throw new Error(`found ${kindOf(json)}, expected numbers [ … ]`);
    return typedArray(json, type);
  }
  if (isComplex(type.base)) return complex(json);
  if (isNumeric(type.base)) return scalar(json, type.base);
  if (type.base === "string" && typeof json !== "string") throw new Error(`found ${kindOf(json)}, expected a "string"`);
  return json;
}

function convertMap(json: unknown, element: TypeText, keys: "string" | "int32"): Map<string | number, unknown> {
  if (typeof json !== "object" || json === null || Array.isArray(json)) {
    throw new Error(`found ${kindOf(json)}, expected a map {"key": …}`);
  }
  const map = new Map<string | number, unknown>();
  for (const [key, value] of Object.entries(json)) {
    map.set(keys === "int32" ? (scalar(key, "int32") as number) : key, convert(value, element));
  }
  return map;
}

function multidim(json: unknown, type: TypeText): { dims: number[]; data: unknown } {
  const { dims, data } = (json ?? {}) as { dims?: unknown; data?: unknown };
  if (!Array.isArray(dims) || !Array.isArray(data)) {
    throw new Error(`found ${kindOf(json)}, expected {"dims": [rows, columns], "data": [column by column]}`);
  }
  const sizes = dims.map((d) => scalar(d, "uint32") as number);
  const count = sizes.reduce((product, size) => product * size, 1);
  if (count !== data.length) throw new Error(`dims ${sizes.join(" × ")} need ${count} elements, found ${data.length}`);
  return { dims: sizes, data: typedArray(data, { ...type, array: "any", sizes: [] }) };
}

function complex(json: unknown): { re: number; im: number } {
  if (!Array.isArray(json) || json.length !== 2) throw new Error(`found ${kindOf(json)}, expected [re, im]`);
  return { re: scalar(json[0], "double") as number, im: scalar(json[1], "double") as number };
}

function scalar(found: unknown, base: string): number | bigint | boolean {
  if (base === "bool") {
    if (found === true || found === "true" || found === "1") return true;
    if (found === false || found === "false" || found === "0") return false;
    throw new Error(`${quote(found)} is not a bool; expected true or false`);
  }
  const text = String(found).trim();
  if (isFloat(base)) {
    const number = /^[+-]?(inf|infinity)$/i.test(text) ? (text.startsWith("-") ? -Infinity : Infinity) : Number(text);
    if (text === "" || (Number.isNaN(number) && !/^nan$/i.test(text))) {
      throw new Error(`${quote(found)} is not a number; expected a ${base} such as 1.5 or -2e3`);
    }
    return number;
  }
  return integer(text, base);
}

function integer(text: string, base: string): number | bigint {
  const [low, high] = INTEGER_RANGES[base] ?? [0n, 0n];
  const match = /^([+-]?)(0x[0-9a-f]+|\d+)$/i.exec(text);
  if (!match) throw new Error(`${quote(text)} is not a whole number; expected ${base}, ${low} to ${high}`);
  const magnitude = BigInt(match[2] ?? "0");
  const value = match[1] === "-" ? -magnitude : magnitude;
  if (value < low || value > high) throw new Error(`${text} is out of range; expected ${base}, ${low} to ${high}`);
  return isWideInteger(base) ? value : Number(value);
}

const ARRAY_OF: Readonly<Record<string, new (length: number) => ArrayLike<number>>> = {
  double: Float64Array,
  single: Float32Array,
  int8: Int8Array,
  uint8: Uint8Array,
  int16: Int16Array,
  uint16: Uint16Array,
  int32: Int32Array,
  uint32: Uint32Array,
  bool: Uint8Array,
};

/** The type of the items of a TypedArray. */
export function itemsOf(value: unknown): string | undefined {
  if (value instanceof BigInt64Array) return "int64";
  if (value instanceof BigUint64Array) return "uint64";
  return Object.entries(ARRAY_OF).find(([, made]) => value instanceof made)?.[0];
}

function typedArray(items: readonly unknown[], type: TypeText): unknown {
  checkLength(items.length, type);
  if (isComplex(type.base)) {
    const numbers = items.map(complex);
    const [re, im] = [numbers.map((n) => n.re), numbers.map((n) => n.im)];
    return type.base === "cdouble"
      ? { re: Float64Array.from(re), im: Float64Array.from(im) }
      : { re: Float32Array.from(re), im: Float32Array.from(im) };
  }
  const values = items.map((item, index) => {
    try {
      return scalar(item, type.base);
    } catch (error) {
      throw new Error(`element ${index}: ${(error as Error).message}`, { cause: error });
    }
  });
  if (type.base === "int64") return BigInt64Array.from(values as bigint[]);
  if (type.base === "uint64") return BigUint64Array.from(values as bigint[]);
  const make = ARRAY_OF[type.base];
  if (!make) throw new Error(`arrays of ${type.base} cannot be typed in here`);
  const array = new make(values.length) as { [index: number]: number; length: number };
  values.forEach((value, index) => (array[index] = Number(value)));
  return array;
}

function checkLength(found: number, type: TypeText): void {
  const size = type.sizes[0] ?? 0;
  if (type.array === "fixed" && found !== size) throw new Error(`found ${found} elements, expected exactly ${size}`);
  if (type.array === "max" && found > size) throw new Error(`found ${found} elements, expected at most ${size}`);
}

function quote(found: unknown): string {
  const text = String(found);
  return `"${text.length > 40 ? `${text.slice(0, 40)}…` : text}"`;
}

function kindOf(json: unknown): string {
  if (json === null) return "null";
  if (Array.isArray(json)) return `a list of ${json.length}`;
  return typeof json === "object" ? "an object" : `${typeof json} ${quote(json)}`;
}
