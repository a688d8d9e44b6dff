// Numbers inside a value by their path: `pose.x`, `joint_position[2]`, `map["key"]`.
// Layer: web/values, pure.

const MOST_PATHS = 200;
const MOST_ITEMS = 32;
const MOST_DEPTH = 6;

/** Where the numbers of `value` are, in order. */
export function numberPaths(value: unknown): string[] {
  const found: string[] = [];
  collect(value, "", found, 0);
  return found;
}

/** Reads the number at `path`; undefined where there is none. Booleans count as 0 and 1. */
export function numberReader(path: string): (value: unknown) => number | undefined {
  const steps = stepsOf(path);
  return (value) => {
    let at = value;
    for (const step of steps) at = child(at, step);
    if (typeof at === "number") return at;
    return typeof at === "bigint" || typeof at === "boolean" ? Number(at) : undefined;
  };
}

function collect(value: unknown, path: string, found: string[], depth: number): void {
  if (found.length >= MOST_PATHS || depth > MOST_DEPTH) return;
  if (typeof value === "number" || typeof value === "bigint" || typeof value === "boolean") found.push(path);
  else if (ArrayBuffer.isView(value) || Array.isArray(value)) {
    const items = value as unknown as ArrayLike<unknown>;
    for (let i = 0; i < Math.min(items.length, MOST_ITEMS); i++) collect(items[i], `${path}[${i}]`, found, depth + 1);
  } else if (value instanceof Map) {
    for (const [key, item] of value) collect(item, `${path}[${JSON.stringify(key)}]`, found, depth + 1);
  } else if (value !== null && typeof value === "object") {
    for (const key of Object.keys(value))
      collect((value as Record<string, unknown>)[key], path === "" ? key : `${path}.${key}`, found, depth + 1);
  }
}

/** Names as texts, indices as numbers. */
export function stepsOf(path: string): (string | number)[] {
  const steps: (string | number)[] = [];
  for (const [, name, index, key] of path.matchAll(/\.?([A-Za-z_]\w*)|\[(-?\d+)\]|\[("(?:[^"\\]|\\.)*")\]/g)) {
    if (name !== undefined) steps.push(name);
    else if (index !== undefined) steps.push(Number(index));
    else if (key !== undefined) steps.push(JSON.parse(key) as string);
  }
  return steps;
}

/** Own fields only: `constructor` and `__proto__` are what the device says, or nothing. */
function child(value: unknown, step: string | number): unknown {
  if (value === null || typeof value !== "object") return undefined;
  if (value instanceof Map) return (value as Map<unknown, unknown>).get(step);
  return Object.hasOwn(value, step) ? (value as Record<string | number, unknown>)[step] : undefined;
}
