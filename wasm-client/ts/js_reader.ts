// Builds the values that the core has written into its memory, each by one call. Layer: wasm-client/ts.
// The other half is src/js_writer.cpp; the numbers of the codes are shared with it.

const decoder = new TextDecoder("utf-8", { ignoreBOM: true });

/** By rr::DataType, from 1 on. */
export const itemTypes = [
  Float64Array,
  Float32Array,
  Int8Array,
  Uint8Array,
  Int16Array,
  Uint16Array,
  Int32Array,
  Uint32Array,
  BigInt64Array,
  BigUint64Array,
];

export const typeMark = Symbol.for("rrgate.type");

/** As rr::JsWriter::Code. */
const codeEnd = 0;
const codeName = 8;
const codeMark = 16;
/** A text follows; with newName it has the number beside it from now on. */
const newName = 0x8000;
const otherName = 0xffff;

export function decodeText(bytes: Uint8Array<ArrayBuffer>, at: number, length: number): string {
  if (length > 32) return decoder.decode(bytes.subarray(at, at + length));
  // Short texts: cheaper than the decoder.
  let text = "";
  for (let i = at; i < at + length; ++i) {
    if (bytes[i]! > 127) return decoder.decode(bytes.subarray(at, at + length));
    text += String.fromCharCode(bytes[i]!);
  }
  return text;
}

/** The reader of one instance of the core. */
export class JsReader {
  /** Those that the core knows by number. */
  readonly #names: string[] = [];
  #bytes!: Uint8Array<ArrayBuffer>;
  #view!: DataView;
  #at = 0;

  /** @param valueOf  what stands in the table under a handle; the core keeps the handle. */
  constructor(private readonly valueOf: (handle: number) => unknown) {}

  /** What is written at `at` of the core's memory. Runs no code of the application, and nothing of the core. */
  read(bytes: Uint8Array<ArrayBuffer>, at: number): unknown {
    if (this.#bytes !== bytes) {
      this.#bytes = bytes;
      this.#view = new DataView(bytes.buffer);
    }
    this.#at = at;
    return this.#value(this.#bytes[this.#at++]!);
  }

  #value(code: number): unknown {
    switch (code) {
      case 2:
        return true;
      case 3:
        return false;
      case 4:
        return this.#view.getFloat64(this.#skip(8), true);
      case 5:
        return this.#view.getBigInt64(this.#skip(8), true);
      case 6:
        return this.#view.getBigUint64(this.#skip(8), true);
      case 7:
        return this.#text();
      case codeName:
        return this.#name();
      case 9: {
        const Type = itemTypes[this.#bytes[this.#at++]! - 1]!;
        const at = this.#word();
        return new Type(this.#bytes.slice(at, at + this.#word()).buffer);
      }
      case 10: {
        const at = this.#word();
        return Array.from(this.#bytes.subarray(at, at + this.#word()), Boolean);
      }
      case 11:
        return this.#parts();
      case 12:
        return this.valueOf(this.#word());
      case 13:
        return this.#object();
      case 14:
        return this.#array();
      case 15:
        return this.#map();
      default:
        return null;
    }
  }

  #object(): object {
    const object: Record<string, unknown> = {};
    for (;;) {
      const code = this.#bytes[this.#at++]!;
      if (code === codeEnd) return object;
      const key = this.#name();
      if (code === codeMark) {
        Object.defineProperty(object, typeMark, { value: key });
      } else if (key === "__proto__") {
        // Always an own property: assigning would replace the prototype.
        const rights = { enumerable: true, writable: true, configurable: true };
        Object.defineProperty(object, key, { value: this.#next(), ...rights });
      } else {
        object[key] = this.#next();
      }
    }
  }

  #array(): unknown[] {
    const array: unknown[] = [];
    for (;;) {
      const code = this.#bytes[this.#at++]!;
      if (code === codeEnd) return array;
      if (code === codeMark) Object.defineProperty(array, typeMark, { value: this.#name() });
      else array.push(this.#value(code));
    }
  }

  #map(): Map<unknown, unknown> {
    const map = new Map<unknown, unknown>();
    for (;;) {
      const code = this.#bytes[this.#at++]!;
      if (code === codeEnd) return map;
      const key = this.#value(code);
      map.set(key, this.#next());
    }
  }

  /** Every second one of pairs of numbers. */
  #parts(): Float64Array | Float32Array {
    const View = this.#bytes[this.#at++] === 1 ? Float64Array : Float32Array;
    const part = this.#bytes[this.#at++]!;
    const at = this.#word();
    const pairs = new View(this.#bytes.slice(at, at + this.#word()).buffer);
    return new View(pairs.length / 2).map((_, index) => pairs[2 * index + part]!);
  }

  #next(): unknown {
    return this.#value(this.#bytes[this.#at++]!);
  }

  #skip(size: number): number {
    this.#at += size;
    return this.#at - size;
  }

  #word(): number {
    return this.#view.getUint32(this.#skip(4), true);
  }

  #text(): string {
    const length = this.#word();
    return decodeText(this.#bytes, this.#skip(length), length);
  }

  #name(): string {
    const code = this.#view.getUint16(this.#skip(2), true);
    if (code === otherName) return this.#text();
    const number = code & ~newName;
    if (code & newName) this.#names[number] = this.#text();
    const name = this.#names[number];
    if (name === undefined)
      throw new Error(`rrgate-client: an earlier value was not read, and the name ${number} is missing`);
    return name;
  }
}
