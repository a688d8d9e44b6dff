// The unit of a number: what the field's documentation says in brackets, or how its name ends.
// Layer: web/values, pure.

import type { Definitions } from "./definitions";
import { parseType } from "./type_text";

/** The first that fits. Of one letter alone only where the rest of the name says so, too. */
const ENDINGS: readonly (readonly [ending: RegExp, unit: string])[] = [
  [/_rad_s$/, "rad/s"],
  [/_deg_s$/, "°/s"],
  [/_mm_s$/, "mm/s"],
  [/_m_s$/, "m/s"],
  [/_m_s2$/, "m/s²"],
  [/_rad$/, "rad"],
  [/_deg$/, "°"],
  [/_mm$/, "mm"],
  [/_m$/, "m"],
  [/_ms$/, "ms"],
  [/_s$/, "s"],
  [/_hz$/, "Hz"],
  [/volt.*_v$/, "V"],
  [/current.*_a$/, "A"],
  [/force.*_n$/, "N"],
  [/(torque|effort|moment).*_nm$/, "Nm"],
];

const UNIT =
  /^(?:%|°C?|rad(?:ians?)?|deg(?:rees?)?|rpm|min|h|K|px|bar|l|[µnmckMG]?(?:m|s|g|V|A|N|Nm|Hz|W|Wh|Ah|Pa|J|T|lx))(?:\/(?:s[²2]?|s\^2|min|h|m[²2³3]?|l))?[²³]?$/;

/** What has the numbers: a member, which tells the unit where no field does. */
interface Source {
  name: string;
  documentation: string;
}

/** "" where nothing tells. `path`: as in paths.ts. */
export function unitOf(type: string, path: string, definitions: Definitions, scope: string, of?: Source): string {
  const names = path.split(/[.[]/).filter((step) => /^[A-Za-z_]/.test(step));
  let [base, within, documentation] = [type, scope, names.length === 0 ? (of?.documentation ?? "") : ""];
  for (const name of names) {
    const struct = definitions.struct(parseType(base || "void").base, within);
    const field = struct?.fields.find((each) => each.name === name);
    if (!struct || !field) return "";
    [base, within, documentation] = [field.type, struct.scope, field.documentation];
  }
  for (const [, bracketed, named] of documentation.matchAll(/[[(]([^\])\s]{1,12})[\])]|\bin ([^\s.,;]{1,12})/g)) {
    const said = bracketed ?? named ?? "";
    if (UNIT.test(said)) return said;
  }
  const last = (names[names.length - 1] ?? of?.name ?? "").toLowerCase();
  return ENDINGS.find(([ending]) => ending.test(last))?.[1] ?? "";
}
