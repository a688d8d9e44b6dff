// Values that say their type. Layer: wasm-client/ts. The marks are read in js_values.ts.

const exactMark = Symbol.for("rrgate.exactValue");
const typeMark = Symbol.for("rrgate.type");

/** A value with the type that it is to be sent as, where the definition leaves that open (varvalue). */
export interface ExactValue {
  readonly type: string;
  readonly value: unknown;
}

/**
 * Says which type a varvalue is to have: `rrValue("int16[]", [1, 2])`, `rrValue("com.example.Pose", {x: 1, y: 2})`.
 * @param type as in a service definition; named types with their service.
 */
export function rrValue(type: string, value: unknown): ExactValue {
  return Object.freeze(Object.defineProperty({ type, value }, exactMark, { value: true, enumerable: false }));
}

/** The named type of a value that came as a varvalue ("com.example.Pose"), undefined for all others. */
export function typeOf(value: unknown): string | undefined {
  if (typeof value !== "object" || value === null) return undefined;
  const mark = (value as { [typeMark]?: unknown })[typeMark];
  return typeof mark === "string" ? mark : undefined;
}
