// Shows any Robot Raconteur value as short text, bounded in length whatever the value's size.
// Layer: web/values, pure.

const MAX_ITEMS = 16;
const MAX_DEPTH = 4;
const MAX_STRING = 400;

/** One line for scalars and small arrays; nested values indent by two blanks a level. */
export function formatValue(value: unknown, depth = 0): string {
  if (value === undefined) return "done";
  if (value === null) return "null";
  if (typeof value === "number") return formatNumber(value);
  if (typeof value === "bigint" || typeof value === "boolean") return String(value);
  if (typeof value === "string") return depth === 0 ? shorten(value) : JSON.stringify(shorten(value));
  if (depth >= MAX_DEPTH) return "…";
  if (ArrayBuffer.isView(value)) return formatArray(value as unknown as ArrayLike<number | bigint>);
  if (Array.isArray(value)) return formatList(value, depth);
  if (value instanceof Map) return formatFields([...value.entries()], depth);
  if (typeof value === "object") return formatObject(value as Record<string, unknown>, depth);
  return `(${typeof value})`;
}

/** At most six significant digits, no exponent for everyday sizes, a real minus sign never (values get copied). */
export function formatNumber(value: number): string {
  if (Number.isInteger(value) && Math.abs(value) < 1e15) return String(value);
  if (!Number.isFinite(value)) return String(value);
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-4 || size >= 1e9)) return value.toExponential(4);
  return String(Number(value.toPrecision(6)));
}

/** `01 a0 ff`, at most `limit` bytes and then an ellipsis. */
export function formatHex(bytes: ArrayLike<number>, limit = 24): string {
  const shown = Array.from({ length: Math.min(bytes.length, limit) }, (_, i) =>
    (bytes[i] ?? 0).toString(16).padStart(2, "0"),
  );
  return shown.join(" ") + (bytes.length > limit ? " …" : "");
}

function formatArray(array: ArrayLike<number | bigint>): string {
  if (array.length === 0) return "[ ]";
  const shown = Array.from({ length: Math.min(array.length, MAX_ITEMS) }, (_, i) => {
    const item = array[i];
    return typeof item === "bigint" ? String(item) : formatNumber(item ?? 0);
  });
  const rest = array.length - shown.length;
  return `[${shown.join(", ")}${rest > 0 ? `, … ${rest} more` : ""}]`;
}

function formatList(list: readonly unknown[], depth: number): string {
  if (list.length === 0) return "[ ]";
  const shown = list.slice(0, MAX_ITEMS).map((item) => formatValue(item, depth + 1));
  const rest = list.length - shown.length;
  if (rest > 0) shown.push(`… ${rest} more`);
  const line = `[${shown.join(", ")}]`;
  return line.length <= 72 && !line.includes("\n") ? line : `[\n${indent(shown.join(",\n"))}\n]`;
}

function formatObject(object: Record<string, unknown>, depth: number): string {
  const { dims, data, re, im } = object;
  if (typeof re === "number" && typeof im === "number" && Object.keys(object).length === 2) {
    return `${formatNumber(re)} ${im < 0 ? "-" : "+"} ${formatNumber(Math.abs(im))}i`;
  }
  if (Array.isArray(dims) && ArrayBuffer.isView(data) && Object.keys(object).length === 2) {
    return `${dims.join(" × ")} ${formatValue(data, depth)}`;
  }
  const bytes = object["uuid_bytes"]; // com.robotraconteur.uuid.UUID
  if (bytes instanceof Uint8Array && bytes.length === 16 && Object.keys(object).length === 1) return formatUuid(bytes);
  return formatFields(Object.entries(object), depth);
}

function formatUuid(bytes: Uint8Array): string {
  return formatHex(bytes)
    .replaceAll(" ", "")
    .replace(/^(.{8})(.{4})(.{4})(.{4})/, "$1-$2-$3-$4-");
}

function formatFields(fields: readonly (readonly [unknown, unknown])[], depth: number): string {
  if (fields.length === 0) return "{ }";
  const lines = fields
    .slice(0, MAX_ITEMS * 2)
    .map(([key, value]) => `${String(key)}: ${formatValue(value, depth + 1)}`);
  if (fields.length > lines.length) lines.push(`… ${fields.length - lines.length} more`);
  if (depth === 0) return lines.join("\n");
  const line = `{${lines.join(", ")}}`;
  return line.length <= 72 && !line.includes("\n") ? line : `{\n${indent(lines.join("\n"))}\n}`;
}

function indent(text: string): string {
  return text.replace(/^/gm, "  ");
}

function shorten(text: string): string {
  return text.length > MAX_STRING ? `${text.slice(0, MAX_STRING)}… (${text.length} characters)` : text;
}
