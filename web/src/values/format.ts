// Shows any Robot Raconteur value as short text, bounded in length whatever the value's size.
// Layer: web/values, pure.

const MAX_ITEMS = 16;
const MAX_DEPTH = 4;
const MAX_STRING = 400;

/** One line for scalars and small arrays; nested values indent by two blanks a level. */
export function format_value(value: unknown, depth = 0): string {
  if (value === undefined) return "done";
  if (value === null) return "null";
  if (typeof value === "number") return format_number(value);
  if (typeof value === "bigint" || typeof value === "boolean") return String(value);
  if (typeof value === "string") return depth === 0 ? shorten(value) : JSON.stringify(shorten(value));
  if (depth >= MAX_DEPTH) return "…";
  if (ArrayBuffer.isView(value)) return format_array(value as unknown as ArrayLike<number | bigint>);
  if (Array.isArray(value)) return format_list(value, depth);
  if (value instanceof Map) return format_fields([...value.entries()], depth);
  if (typeof value === "object") return format_object(value as Record<string, unknown>, depth);
  return `(${typeof value})`;
}

/** At most six significant digits, no exponent for everyday sizes, a real minus sign never (values get copied). */
export function format_number(value: number): string {
  if (Number.isInteger(value) && Math.abs(value) < 1e15) return String(value);
  if (!Number.isFinite(value)) return String(value);
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-4 || size >= 1e9)) return value.toExponential(4);
  return String(Number(value.toPrecision(6)));
}

export function format_bytes(count: number): string {
  if (count < 1024) return `${count} B`;
  if (count < 1024 * 1024) return `${(count / 1024).toFixed(count < 10240 ? 1 : 0)} KB`;
  return `${(count / 1024 / 1024).toFixed(1)} MB`;
}

/** `01 a0 ff`, at most `limit` bytes and then an ellipsis. */
export function format_hex(bytes: ArrayLike<number>, limit = 24): string {
  const shown = Array.from({ length: Math.min(bytes.length, limit) }, (_, i) =>
    (bytes[i] ?? 0).toString(16).padStart(2, "0"),
  );
  return shown.join(" ") + (bytes.length > limit ? " …" : "");
}

function format_array(array: ArrayLike<number | bigint>): string {
  if (array.length === 0) return "[ ]";
  const shown = Array.from({ length: Math.min(array.length, MAX_ITEMS) }, (_, i) => {
    const item = array[i];
    return typeof item === "bigint" ? String(item) : format_number(item ?? 0);
  });
  const rest = array.length - shown.length;
  return `[${shown.join(", ")}${rest > 0 ? `, … ${rest} more` : ""}]`;
}

function format_list(list: readonly unknown[], depth: number): string {
  if (list.length === 0) return "[ ]";
  const shown = list.slice(0, MAX_ITEMS).map((item) => format_value(item, depth + 1));
  const rest = list.length - shown.length;
  if (rest > 0) shown.push(`… ${rest} more`);
  const line = `[${shown.join(", ")}]`;
  return line.length <= 72 && !line.includes("\n") ? line : `[\n${indent(shown.join(",\n"))}\n]`;
}

function format_object(object: Record<string, unknown>, depth: number): string {
  const { dims, data, re, im } = object;
  if (typeof re === "number" && typeof im === "number" && Object.keys(object).length === 2) {
    return `${format_number(re)} ${im < 0 ? "-" : "+"} ${format_number(Math.abs(im))}i`;
  }
  if (Array.isArray(dims) && ArrayBuffer.isView(data) && Object.keys(object).length === 2) {
    return `${dims.join(" × ")} ${format_value(data, depth)}`;
  }
  return format_fields(Object.entries(object), depth);
}

function format_fields(fields: readonly (readonly [unknown, unknown])[], depth: number): string {
  if (fields.length === 0) return "{ }";
  const lines = fields.slice(0, MAX_ITEMS * 2).map(([key, value]) => `${String(key)}: ${format_value(value, depth + 1)}`);
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
