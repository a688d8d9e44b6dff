// The unit of a number: what the field's documentation says in brackets, or how its name ends.
// Layer: web/values, pure.

import type { Definitions } from "./definitions";
import { parseType } from "./type_text";

const ENDINGS: Readonly<Record<string, string>> = {
  _rad: "rad",
  _deg: "°",
  _m: "m",
  _mm: "mm",
  _s: "s",
  _ms: "ms",
  _hz: "Hz",
  _v: "V",
  _a: "A",
  _n: "N",
  _nm: "Nm",
};

/** "" where nothing tells. `path`: as in paths.ts. */
export function unitOf(type: string, path: string, definitions: Definitions, scope: string): string {
  const names = path.split(/[.[]/).filter((step) => /^[A-Za-z_]/.test(step));
  let [base, within, documentation] = [type, scope, ""];
  for (const name of names) {
    const struct = definitions.struct(parseType(base || "void").base, within);
    const field = struct?.fields.find((each) => each.name === name);
    if (!struct || !field) return "";
    [base, within, documentation] = [field.type, struct.scope, field.documentation];
  }
  const said =
    /\[([^\]\s]{1,12})\]|\(([a-zA-Zµ°%/²³]{1,6})\)|\bin (mm|cm|m|rad|radians|degrees|deg|s|ms|V|A|N|Nm|Hz|mm\/s|m\/s)\b/.exec(
      documentation,
    );
  if (said) return said[1] ?? said[2] ?? said[3] ?? "";
  const last = names[names.length - 1] ?? "";
  const ending = Object.keys(ENDINGS).find((each) => last.toLowerCase().endsWith(each));
  return ending === undefined ? "" : (ENDINGS[ending] ?? "");
}
