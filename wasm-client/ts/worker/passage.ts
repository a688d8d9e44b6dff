// Values on their way from one thread to another: what is copied, what is handed over, and the marks that a message would
// lose. Layer: wasm-client/ts/worker.
import { makeError, RobotRaconteurError, textOf } from "../errors.js";
import { rrValue, typeOf } from "../values.js";

const exactMark = Symbol.for("rrgate.exactValue");
const typeMark = Symbol.for("rrgate.type");

/** The core's own limit: value_from_js.hpp. */
const maxDepth = 256;

/** An object of a message, and the type of what came as a varvalue; true for what rrValue() gave. */
type Mark = [object: object, type: string | true];

/** What a message needs besides itself. */
export interface Cargo {
  /** Buffers of its arrays, which are the receiver's from then on. */
  readonly transfer: ArrayBuffer[];
  /** Travels in the same message: there, objects stay the same. */
  readonly marks: Mark[];
  /** About as many bytes as it takes, without names. */
  size: number;
}

/**
 * Looks through a value that is nobody else's: decoded, or made by copyOf().
 * @param cargo  what else is in the message.
 */
export function weigh(value: unknown, cargo: Cargo = { transfer: [], marks: [], size: 0 }): Cargo {
  if (typeof value === "string") cargo.size += 2 * value.length;
  else if (typeof value !== "object" || value === null) cargo.size += 8;
  else if (ArrayBuffer.isView(value)) {
    cargo.size += value.byteLength;
    cargo.transfer.push(value.buffer as ArrayBuffer);
  } else {
    cargo.size += 16;
    const type = isExact(value) || typeOf(value);
    if (type) cargo.marks.push([value, type]);
    const items = value instanceof Map ? value.values() : Array.isArray(value) ? value : Object.values(value);
    for (const item of items as Iterable<unknown>) weigh(item, cargo);
  }
  return cargo;
}

/** Gives the objects of a message that has come their marks back. */
export function restore(marks: readonly Mark[] | undefined): void {
  for (const [object, type] of marks ?? [])
    Object.defineProperty(object, type === true ? exactMark : typeMark, { value: type });
}

/**
 * A copy of what the application gave: its arrays remain its own. Of objects, the enumerable properties that they have
 * themselves; what no message takes becomes something that no service takes either.
 * @throws RobotRaconteurError DataTypeError: it holds itself; InvalidArgument: it could not be read.
 */
export function copyOf(value: unknown): unknown {
  try {
    return copy(value, new Set());
  } catch (error) {
    if (error instanceof RobotRaconteurError) throw error;
    throw makeError("InvalidArgument", `convert for the worker: a value could not be read: ${textOf(error)}`);
  }
}

/** `around`: the objects that hold it. */
function copy(value: unknown, around: Set<object>): unknown {
  if (typeof value === "function" || typeof value === "symbol") return new Date(0);
  if (typeof value !== "object" || value === null) return value;
  const tag = Object.prototype.toString.call(value);
  if (tag === "[object Date]" || tag === "[object DataView]" || tag.endsWith("ArrayBuffer]")) return new Date(0);
  if (around.has(value) || around.size > maxDepth) {
    throw makeError("DataTypeError", "convert for the worker: a value is nested too deeply, or holds itself");
  }
  around.add(value);
  const items = copyItems(value, tag, (item) => copy(item, around));
  around.delete(value);
  const type = typeOf(value);
  return type === undefined ? items : Object.defineProperty(items, typeMark, { value: type });
}

function copyItems(value: object, tag: string, itemOf: (item: unknown) => unknown): object {
  if (ArrayBuffer.isView(value)) return (value as Uint8Array).slice();
  if (Array.isArray(value)) return Array.from(value, itemOf);
  if (isExact(value)) return rrValue(value.type, itemOf(value.value));
  if (tag !== "[object Map]")
    return Object.fromEntries(Object.entries(value).map(([name, item]) => [name, itemOf(item)]));
  const items = new Map<unknown, unknown>();
  Map.prototype.forEach.call(value, (item, key) => items.set(key, itemOf(item)));
  return items;
}

const isExact = (value: object): value is { type: string; value: unknown } =>
  (value as { [exactMark]?: unknown })[exactMark] === true;
