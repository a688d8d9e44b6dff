// JavaScript values as the core sees them: numbers of places in a table, and what it does with them. Layer: wasm-client/ts.
// The other half is src/js_access.cpp, which declares the functions below; numbers of kinds and types are shared with it.
// No exception may cross frames of WebAssembly (they would not be unwound): whatever can run code of the application,
// a getter or a Proxy, is caught in here and reported as handle 0 or a negative number.

import { decodeText, itemTypes, JsReader, typeMark } from "./js_reader.js";

/** A place in the table. */
export type Handle = number;
const failed: Handle = 0;

const exactMark = Symbol.for("rrgate.exactValue");
const encoder = new TextEncoder();

const itemNames = itemTypes.map((type) => type.name);
/** The engine's own getter: knows arrays of other realms (frames, vm contexts), runs no foreign code, never throws. */
const nameOfItems = Object.getOwnPropertyDescriptor(
  Object.getPrototypeOf(Uint8Array.prototype) as object,
  Symbol.toStringTag,
)!.get!;

type Dictionary = Record<PropertyKey, unknown>;

/** 0 for what is no TypedArray. */
function itemsType(value: unknown): number {
  const name = nameOfItems.call(value) as string | undefined;
  return name === undefined ? 0 : 1 + itemNames.indexOf(name === "Uint8ClampedArray" ? "Uint8Array" : name);
}

/** As rr::JsKind. */
function kindOf(value: unknown): number {
  switch (typeof value) {
    case "undefined":
      return 0;
    case "boolean":
      return 2;
    case "number":
      return 3;
    case "bigint":
      return 4;
    case "string":
      return 5;
    case "object":
      break;
    default:
      return 11;
  }
  if (value === null) return 1;
  if (Array.isArray(value)) return 6;
  if (itemsType(value)) return 7;
  const tag = Object.prototype.toString.call(value);
  if (tag === "[object Map]") return 8;
  if ((value as Dictionary)[exactMark] === true) return 9;
  return tag === "[object ArrayBuffer]" || tag === "[object Date]" || ArrayBuffer.isView(value) ? 11 : 10;
}

/** Members that the object or its class brings; not what every object has ("constructor"). */
function fieldOf(object: Dictionary, name: string): unknown {
  if (Object.hasOwn(object, name)) return object[name];
  return name in object && !(name in Object.prototype) ? object[name] : undefined;
}

export interface CoreExports {
  readonly memory: WebAssembly.Memory;
  allocate(size: number): number;
}

/** The table of one instance of the core. */
export class JsValues {
  /** The first ones as rr::JsHandle says; 0 stands for what could not be read. */
  readonly #values: unknown[] = [undefined, undefined, null, true, false];
  readonly #free: Handle[] = [];
  readonly #reader = new JsReader((handle) => this.#values[handle]);
  #core!: CoreExports;
  #bytes: Uint8Array<ArrayBuffer> = new Uint8Array(0);

  /** Once, before anything else: the instance that was made with `imports`. */
  attach(core: CoreExports): void {
    this.#core = core;
  }

  /** A view on the core's memory as it is now. */
  get bytes(): Uint8Array<ArrayBuffer> {
    // Growing detaches the buffer; then its views are empty.
    if (this.#bytes.length === 0) this.#bytes = new Uint8Array(this.#core.memory.buffer);
    return this.#bytes;
  }

  /** The core takes the handle over. */
  give(value: unknown): Handle {
    if (value === undefined) return 1;
    if (value === null) return 2;
    if (value === true) return 3;
    if (value === false) return 4;
    const handle = this.#free.pop() ?? this.#values.length;
    this.#values[handle] = value;
    return handle;
  }

  /** What the core gave away. */
  take(handle: Handle): unknown {
    const value = this.#values[handle];
    this.#release(handle);
    return value;
  }

  #release(handle: Handle): void {
    if (handle <= 4) return;
    this.#values[handle] = undefined;
    this.#free.push(handle);
  }

  /** A handle for what `read` gives, unless it throws. */
  #attempt(read: () => unknown): Handle {
    try {
      return this.give(read());
    } catch {
      return failed;
    }
  }

  /** Reads `count` items of an array: -1, or the index of the first that `write` does not take, or -2 on a throw. */
  #readItems(handle: Handle, count: number, write: (item: unknown, index: number) => boolean): number {
    try {
      const items = this.#values[handle] as ArrayLike<unknown>;
      for (let i = 0; i < count; ++i) if (!write(items[i], i)) return i;
      return -1;
    } catch {
      return -2;
    }
  }

  readonly imports = {
    js: {
      copy: (handle: Handle) => this.give(this.#values[handle]),
      release: (handle: Handle) => this.#release(handle),

      kind: (handle: Handle): number => {
        try {
          return kindOf(this.#values[handle]);
        } catch {
          return 11;
        }
      },
      items_type: (handle: Handle) => itemsType(this.#values[handle]),
      number: (handle: Handle) => this.#values[handle] as number,
      bigint: (handle: Handle, isUnsigned: number, to: number): number => {
        const value = this.#values[handle] as bigint;
        if (value !== (isUnsigned ? BigInt.asUintN(64, value) : BigInt.asIntN(64, value))) return 0;
        new DataView(this.bytes.buffer).setBigUint64(to, BigInt.asUintN(64, value), true);
        return 1;
      },
      /** Allocates; 0 where a surrogate stands alone: such text has no UTF-8. */
      text: (handle: Handle, lengthTo: number): number => {
        const text = this.#values[handle] as string;
        if (/\p{Surrogate}/u.test(text)) return 0;
        const encoded = encoder.encode(text);
        const at = this.#core.allocate(encoded.length + 1);
        this.bytes.set(encoded, at);
        new DataView(this.bytes.buffer).setUint32(lengthTo, encoded.length, true);
        return at;
      },
      length: (handle: Handle): number => {
        try {
          const { length } = this.#values[handle] as { length: unknown };
          return typeof length === "number" && length >= 0 && length <= 0x7fffffff ? length : -1;
        } catch {
          return -1;
        }
      },
      item: (handle: Handle, index: number) => this.#attempt(() => (this.#values[handle] as unknown[])[index]),
      field: (handle: Handle, name: number, length: number) =>
        this.#attempt(() => fieldOf(this.#values[handle] as Dictionary, decodeText(this.bytes, name, length))),
      keys: (handle: Handle) => this.#attempt(() => Object.keys(this.#values[handle] as object)),
      /** [key, value, key, value, ...] */
      map_items: (handle: Handle) =>
        this.#attempt(() => {
          const items: unknown[] = [];
          Map.prototype.forEach.call(this.#values[handle], (value, key) => items.push(key, value));
          return items;
        }),
      type_mark: (handle: Handle) =>
        this.#attempt(() => {
          const mark = (this.#values[handle] as Dictionary)[typeMark];
          return typeof mark === "string" ? mark : undefined;
        }),
      copy_items: (handle: Handle, to: number) => {
        const { buffer, byteOffset, byteLength } = this.#values[handle] as Uint8Array;
        this.bytes.set(new Uint8Array(buffer, byteOffset, byteLength), to);
      },
      read_numbers: (handle: Handle, to: number, count: number) => {
        let view = new DataView(this.bytes.buffer);
        return this.#readItems(handle, count, (item, index) => {
          if (typeof item !== "number") return false;
          // A getter may have made the memory grow.
          if (view.buffer !== this.bytes.buffer) view = new DataView(this.bytes.buffer);
          view.setFloat64(to + 8 * index, item, true);
          return true;
        });
      },
      read_booleans: (handle: Handle, to: number, count: number) =>
        this.#readItems(handle, count, (item, index) => {
          if (typeof item !== "boolean") return false;
          this.bytes[to + index] = item ? 1 : 0;
          return true;
        }),

      /** The value that the core has written there. */
      build: (at: number) => this.give(this.#reader.read(this.bytes, at)),

      random: (to: number, size: number) => void crypto.getRandomValues(this.bytes.subarray(to, to + size)),
    },
  };
}
