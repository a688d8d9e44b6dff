// Finds the numbers in a value that are worth a line in a plot.
// Layer: web/values, pure.

export interface Reading {
  /** Where in the value: "" for a plain number, `pose.x`, `wheels[1]`. */
  label: string;
  value: number;
}

const MAX_READINGS = 6;
const MAX_ARRAY = 6; // longer arrays are data (images, packets), not readings

/** The numeric leaves of `value` in order, at most six; booleans count as 0 and 1. */
export function readingsOf(value: unknown): Reading[] {
  const found: Reading[] = [];
  collect(value, "", found, 0);
  return found;
}

function collect(value: unknown, label: string, found: Reading[], depth: number): void {
  if (found.length >= MAX_READINGS || depth > 3) return;
  if (typeof value === "number") found.push({ label, value });
  else if (typeof value === "bigint" || typeof value === "boolean") found.push({ label, value: Number(value) });
  else if (ArrayBuffer.isView(value)) {
    const array = value as unknown as ArrayLike<number | bigint>;
    if (array.length > MAX_ARRAY) return;
    for (let i = 0; i < array.length; i++) collect(array[i], `${label}[${i}]`, found, depth + 1);
  } else if (value !== null && typeof value === "object" && !Array.isArray(value) && !(value instanceof Map)) {
    for (const [key, field] of Object.entries(value)) {
      collect(field, label === "" ? key : `${label}.${key}`, found, depth + 1);
    }
  }
}
