// A value of any type as the rows of a table.
// Layer: web/values, pure.

import { enumName, flagNames } from "./definitions";
import type { Definitions } from "./definitions";
import { formatUuid, uuidBytes } from "./draft";
import { formatValue } from "./format";
import { timeText } from "./times";
import { parseType } from "./type_text";
import { unitOf } from "./units";

export interface Row {
  /** As in paths.ts; unique in the table. */
  path: string;
  depth: number;
  name: string;
  text: string;
  /** What the definition says of the field. */
  note: string;
}

const MOST_ROWS = 200;
const MOST_DEPTH = 4;

export function rowsOf(value: unknown, type: string, definitions: Definitions, scope: string): Row[] {
  const rows: Row[] = [];
  add(rows, value, { type, definitions, scope, root: type, rootScope: scope }, "", "", "", 0);
  return rows;
}

interface Of {
  type: string;
  definitions: Definitions;
  scope: string;
  root: string;
  rootScope: string;
}

function add(rows: Row[], value: unknown, of: Of, path: string, name: string, note: string, depth: number): void {
  if (rows.length >= MOST_ROWS) return;
  const parsed = of.type === "" ? null : parseType(of.type);
  const struct =
    parsed && parsed.array === "none" && parsed.container === "none"
      ? of.definitions.struct(parsed.base, of.scope)
      : undefined;
  const fields = struct && value !== null && typeof value === "object" ? value : undefined;
  const whole = struct && fields && wholeText(struct.name, fields);
  if (struct && fields && whole === undefined && depth < MOST_DEPTH) {
    if (path !== "") rows.push({ path, depth, name, text: "", note });
    for (const field of struct.fields) {
      const next = { ...of, type: field.type, scope: struct.scope };
      const at = path === "" ? field.name : `${path}.${field.name}`;
      const held = Object.hasOwn(fields, field.name) ? (fields as Record<string, unknown>)[field.name] : undefined;
      add(rows, held, next, at, field.name, field.documentation, depth + (path === "" ? 0 : 1));
    }
    return;
  }
  rows.push({ path, depth, name, text: whole ?? words(value, of, path, name), note });
}

/** A struct whose fields say less than the whole. */
function wholeText(struct: string, value: object): string | undefined {
  if (struct === "com.robotraconteur.uuid.UUID") return formatUuid(uuidBytes(value)) || undefined;
  return timeText(struct, value);
}

function words(value: unknown, of: Of, path: string, name: string): string {
  if (value === undefined) return "–";
  if (typeof value === "number" || typeof value === "bigint") {
    const type = of.type === "" ? undefined : of.definitions.enum(parseType(of.type).base, of.scope);
    if (type) return enumName(value, type) ?? String(value);
    const flags = of.definitions.flags(name, of.scope);
    if (flags) return flagNames(value, flags).join(", ") || "–";
  }
  if (typeof value === "string") return formatValue(value);
  const unit = of.root === "" ? "" : unitOf(of.root, path, of.definitions, of.rootScope);
  return `${formatValue(value, 1)}${unit === "" ? "" : ` ${unit}`}`;
}
