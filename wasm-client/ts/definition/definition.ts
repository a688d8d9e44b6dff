// What a service definition declares, as values. Loaded when it is asked for. Layer: wasm-client/ts.
// Source: service definitions spec sections 5.1..5.6.
import { makeError } from "../errors.js";
import { freezeInfo } from "../object.js";
import type { Session } from "../session.js";
import type { DefinitionInfo, NumericArray, RrValue, TypeInfo } from "../types.js";
import type { RawConstant, RawDefinition } from "../wasm_module.js";

type Constants = DefinitionInfo["constants"];

/** See ObjectInfo.definition(). */
export async function definition(
  session: Session,
  type: string,
  name = type.replace(/\.[^.]*$/, ""),
): Promise<DefinitionInfo> {
  const asked = session.look((core) => [core.definition(name)]);
  if (!asked) throw makeError("InvalidOperation", "definition: the session is closed");
  const raw = await asked[0];
  if (raw) return makeDefinition(raw);
  throw makeError("InvalidArgument", `definition: "${name}" is not known`);
}

/** See ObjectInfo.constants. */
export async function constants(session: Session, type: string): Promise<Constants> {
  const { constants: shared, types } = await definition(session, type);
  const own = types[type.slice(type.lastIndexOf(".") + 1)]?.constants ?? {};
  return record([...Object.entries(shared), ...Object.entries(own)]);
}

/** As the core gives it; constants still as they are written. */
function makeDefinition(raw: RawDefinition): DefinitionInfo {
  const notes = new Map<string, string>();
  const note = (name: string, { documentation }: { documentation: string }) => {
    if (documentation !== "") notes.set(name, tidy(documentation));
  };
  for (const item of [...raw.constants, ...raw.enums, ...raw.exceptions]) note(item.name, item);
  for (const item of raw.enums) for (const value of item.values) note(`${item.name}.${value.name}`, value);
  for (const type of raw.types) for (const item of type.constants) note(`${type.name}.${item.name}`, item);
  return Object.freeze({
    name: raw.name,
    documentation: tidy(raw.documentation),
    constants: constantsOf(raw.constants),
    enums: record(raw.enums.map((item) => [item.name, record(item.values.map(({ name, value }) => [name, value]))])),
    exceptions: Object.freeze(raw.exceptions.map(({ name }) => `${raw.name}.${name}`)),
    types: record(
      raw.types.map((type): [string, TypeInfo] => [
        type.name,
        Object.freeze({
          name: `${raw.name}.${type.name}`,
          kind: type.kind,
          implements: Object.freeze(type.implements),
          constants: constantsOf(type.constants),
          members: Object.freeze(type.members.map(freezeInfo)),
          documentation: tidy(type.documentation),
        }),
      ]),
    ),
    notes,
  });
}

function constantsOf(list: readonly RawConstant[]): Constants {
  const written = new Map(list.map((item) => [item.name, item]));
  const values = new Map<string, RrValue>();
  // Each once, however many structs hold it; one that holds itself does not get there.
  const valueOf = (name: string): RrValue => {
    const item = written.get(name);
    written.delete(name);
    if (item) values.set(name, readConstant(item, valueOf));
    return values.get(name) ?? null;
  };
  for (const { name } of list) valueOf(name);
  return record([...values]);
}

const numberArrays: Record<string, { from(items: number[]): NumericArray }> = {
  double: Float64Array,
  single: Float32Array,
  int8: Int8Array,
  uint8: Uint8Array,
  int16: Int16Array,
  uint16: Uint16Array,
  int32: Int32Array,
  uint32: Uint32Array,
};

/** What is no value of its type stays as it is written. */
function readConstant(item: RawConstant, valueOf: (name: string) => RrValue): RrValue {
  try {
    return parseConstant(item, valueOf);
  } catch {
    return item.text;
  }
}

function parseConstant({ type, text }: RawConstant, valueOf: (name: string) => RrValue): RrValue {
  const base = type.replace(/\[.*/, "");
  if (base === "string") return String(JSON.parse(text)); // written as there
  const items = /^\{([^]*)\}$/.exec(text)?.[1];
  const words = (items ?? text)
    .split(",")
    .map((word) => word.trim())
    .filter((word) => word !== "");
  if (base in numberArrays) {
    const numbers = words.map((word) => signed(word, Number));
    if (items !== undefined) return numberArrays[base]?.from(numbers) ?? null;
    return base === "single" ? Math.fround(numbers[0] ?? 0) : (numbers[0] ?? 0);
  }
  if (base === "int64" || base === "uint64") {
    const numbers = words.map((word) => signed(word, BigInt));
    if (items === undefined) return numbers[0] ?? 0n;
    return (base === "int64" ? BigInt64Array : BigUint64Array).from(numbers);
  }
  return record(
    words.map((word): [string, RrValue] => {
      const [name = "", constant = ""] = word.split(":");
      return [name.trim(), valueOf(constant.trim())];
    }),
  );
}

/** JavaScript takes no sign before "0x". */
function signed<T extends number | bigint>(word: string, read: (digits: string) => T): T {
  const value = read(word.replace(/^[+-]/, ""));
  return word.startsWith("-") ? (-value as T) : value;
}

/** Without prototype: names are what services like. */
function record<T>(entries: readonly (readonly [string, T])[]): Readonly<Record<string, T>> {
  const object = Object.create(null) as Record<string, T>;
  for (const [name, value] of entries) object[name] = value;
  return Object.freeze(object);
}

/** The text stands right behind its "##"; the customary blank there is not meant. */
const tidy = (documentation: string) => documentation.replace(/^ /gm, "").trim();
