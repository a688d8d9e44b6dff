// Reads the text of a Robot Raconteur type, such as `double[3]{list}`, into its parts.
// Layer: web/values, pure. Source: service definition language, TYPE in the grammar.

export type ArrayKind = "none" | "any" | "fixed" | "max" | "multidim";
export type Container = "none" | "list" | "int32" | "string" | "generator";

export interface TypeText {
  /** The word before any bracket: `double`, `string`, `Pose`, `com.example.Pose`. */
  base: string;
  array: ArrayKind;
  /** `[n]` and `[n-]`: one number; `[n,m]` and `[n,]`: the fixed dimensions; else empty. */
  sizes: number[];
  container: Container;
}

const TYPE = /^([A-Za-z][\w.]*)(\[[^\]]*\])?(\{(list|int32|string|generator)\})?$/;

/** @throws Error when `text` is not a type. */
export function parseType(text: string): TypeText {
  const match = TYPE.exec(text.trim());
  if (!match) throw new Error(`"${text}" is not a Robot Raconteur type`);
  const [, base = "", brackets, , container = "none"] = match;
  const { array, sizes } = parseArray(brackets);
  return { base, array, sizes, container: container as Container };
}

function parseArray(brackets: string | undefined): Pick<TypeText, "array" | "sizes"> {
  if (brackets === undefined) return { array: "none", sizes: [] };
  const inner = brackets.slice(1, -1);
  if (inner === "") return { array: "any", sizes: [] };
  if (inner === "*") return { array: "multidim", sizes: [] };
  if (inner.includes(",")) return { array: "multidim", sizes: inner.split(",").filter(Boolean).map(Number) };
  if (inner.endsWith("-")) return { array: "max", sizes: [Number(inner.slice(0, -1))] };
  return { array: "fixed", sizes: [Number(inner)] };
}

/** Inclusive ranges of the integer words; 64-bit ones are held as BigInt in values. */
export const INTEGER_RANGES: Readonly<Record<string, readonly [bigint, bigint]>> = {
  int8: [-128n, 127n],
  uint8: [0n, 255n],
  int16: [-32768n, 32767n],
  uint16: [0n, 65535n],
  int32: [-2147483648n, 2147483647n],
  uint32: [0n, 4294967295n],
  int64: [-(2n ** 63n), 2n ** 63n - 1n],
  uint64: [0n, 2n ** 64n - 1n],
};

export function isInteger(base: string): boolean {
  return base in INTEGER_RANGES;
}

export function isWideInteger(base: string): boolean {
  return base === "int64" || base === "uint64";
}

export function isFloat(base: string): boolean {
  return base === "double" || base === "single";
}

export function isComplex(base: string): boolean {
  return base === "cdouble" || base === "csingle";
}

/** Words whose arrays travel as TypedArrays. */
export function isNumeric(base: string): boolean {
  return isInteger(base) || isFloat(base) || isComplex(base) || base === "bool";
}
