// The structs and enums that a service has declared, so that forms and tables know fields and names.
// Layer: web/values, pure. Source: service definition language; the texts were verified by the client.

export interface Field {
  name: string;
  type: string;
  documentation: string;
}

export interface Struct {
  kind: "struct" | "pod" | "namedarray";
  /** Qualified. */
  name: string;
  /** The definition that its fields' types are named in. */
  scope: string;
  fields: readonly Field[];
}

export interface Enum {
  name: string;
  /** By name, in the order of the definition. */
  values: ReadonlyMap<string, number>;
}

interface Definition {
  name: string;
  /** What a short name of another definition stands for. */
  using: Map<string, string>;
  structs: Map<string, Struct>;
  enums: Map<string, Enum>;
  /** Objects: the types that they implement, as their lines name them. */
  objects: Map<string, string[]>;
}

export class Definitions {
  readonly #byName = new Map<string, Definition>();

  constructor(texts: readonly string[]) {
    for (const text of texts) {
      const definition = readDefinition(text);
      this.#byName.set(definition.name, definition);
    }
  }

  /** The struct, pod or namedarray that `base` names in the definition `scope`; undefined for words and enums. */
  struct(base: string, scope: string): Struct | undefined {
    const [definition, name] = this.#find(base, scope);
    return definition?.structs.get(name);
  }

  enum(base: string, scope: string): Enum | undefined {
    const [definition, name] = this.#find(base, scope);
    return definition?.enums.get(name);
  }

  /** The enum whose bits a field such as `robot_state_flags` holds: RobotStateFlags. */
  flags(field: string, scope: string): Enum | undefined {
    if (!/(^|_)flags$/.test(field)) return undefined;
    const enums = [...(this.#byName.get(scope)?.enums.values() ?? [])];
    const wanted = field.replaceAll("_", "").toLowerCase();
    const lower = (each: Enum): string => each.name.slice(each.name.lastIndexOf(".") + 1).toLowerCase();
    return enums.find((each) => lower(each) === wanted) ?? enums.find((each) => lower(each).endsWith(wanted));
  }

  /** The qualified types that an object of `type` is, too: those that it implements, and what they implement. */
  implemented(type: string): Set<string> {
    const found = new Set<string>();
    const look = (each: string): void => {
      const [definition, name] = this.#find(each, scopeOf(each));
      for (const base of definition?.objects.get(name) ?? []) {
        const qualified = this.#qualify(base, definition?.name ?? "");
        if (found.has(qualified)) continue; // a definition may go round in circles
        found.add(qualified);
        look(qualified);
      }
    };
    look(type);
    return found;
  }

  #qualify(base: string, scope: string): string {
    return base.includes(".") ? base : (this.#byName.get(scope)?.using.get(base) ?? `${scope}.${base}`);
  }

  #find(base: string, scope: string): [Definition | undefined, string] {
    const qualified = this.#qualify(base, scope);
    const dot = qualified.lastIndexOf(".");
    return [this.#byName.get(qualified.slice(0, dot)), qualified.slice(dot + 1)];
  }
}

/** The definition that a qualified name belongs to: `a.b.C` gives `a.b`. */
export function scopeOf(qualified: string): string {
  return qualified.slice(0, Math.max(0, qualified.lastIndexOf(".")));
}

/** The names of the bits that are set, the rest as a number. */
export function flagNames(value: number | bigint, flags: Enum): string[] {
  let rest = BigInt(value);
  const names: string[] = [];
  for (const [name, bit] of flags.values) {
    if (bit <= 0 || (rest & BigInt(bit)) !== BigInt(bit)) continue;
    names.push(name);
    rest &= ~BigInt(bit);
  }
  if (rest !== 0n) names.push(`0x${rest.toString(16)}`);
  return names;
}

export function enumName(value: unknown, type: Enum): string | undefined {
  for (const [name, number] of type.values) if (number === value) return name;
  return undefined;
}

function readDefinition(text: string): Definition {
  const definition: Definition = {
    name: "",
    using: new Map(),
    structs: new Map(),
    enums: new Map(),
    objects: new Map(),
  };
  const lines = text.replace(/\\\r?\n/g, " ").split(/\r?\n/);
  for (let i = 0; i < lines.length; i++) {
    const line = (lines[i] ?? "").trim();
    const [word = "", first = "", second, third] = line.split(/\s+/);
    if (word === "service") definition.name = first;
    else if (word === "using") definition.using.set(second === "as" && third ? third : last(first), first);
    else if (word === "struct" || word === "pod" || word === "namedarray" || word === "enum" || word === "object") {
      const body: string[] = [];
      for (i++; i < lines.length && !isEnd(lines[i] ?? ""); i++) body.push((lines[i] ?? "").trim());
      const name = `${definition.name}.${first}`;
      if (word === "enum") definition.enums.set(first, { name, values: readEnum(body) });
      else if (word === "object") definition.objects.set(first, readImplements(body));
      else definition.structs.set(first, { kind: word, name, scope: definition.name, fields: readFields(body) });
    }
  }
  return definition;
}

/** Old definitions write `end struct`. */
function isEnd(line: string): boolean {
  return /^end(\s+\w+)?$/.test(line.trim());
}

function readImplements(body: readonly string[]): string[] {
  return body.flatMap((line) => /^implements\s+(\S+)/.exec(line)?.[1] ?? []);
}

function readFields(body: readonly string[]): Field[] {
  const fields: Field[] = [];
  let comment: string[] = [];
  for (const line of body) {
    if (line.startsWith("##")) comment.push(line.replace(/^##\s?/, ""));
    if (line.startsWith("#")) continue;
    const match = /^(?:field|property)\s+(\S+)\s+(\w+)/.exec(line);
    if (match) fields.push({ name: match[2] ?? "", type: match[1] ?? "", documentation: comment.join("\n") });
    if (line !== "") comment = [];
  }
  return fields;
}

function readEnum(body: readonly string[]): Map<string, number> {
  const values = new Map<string, number>();
  let next = 0;
  const text = body.map((line) => line.replace(/#.*$/, "")).join(" ");
  for (const part of text.split(",")) {
    const match = /^\s*(\w+)\s*(?:=\s*(-?)(0x[0-9a-fA-F]+|\d+))?\s*$/.exec(part);
    if (!match?.[1]) continue;
    if (match[3] !== undefined) next = Number(match[3]) * (match[2] === "-" ? -1 : 1);
    values.set(match[1], next++);
  }
  return values;
}

function last(qualified: string): string {
  return qualified.slice(qualified.lastIndexOf(".") + 1);
}
