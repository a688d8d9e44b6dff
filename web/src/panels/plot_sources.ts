// The members of a plot, and of each which of its numbers are drawn; in the settings of the panel.
// Layer: web/panels, pure. Boards that were made for one member have it in `member` and `paths`: so does the first of several.

import type { Settings } from "../board/board";
import { textIn, textsIn } from "./panel";

export interface PlotSource {
  member: string;
  /** None: the usual ones. */
  paths: readonly string[];
}

export const MOST_SOURCES = 16;
const OWN = ["member", "paths", "more"];

/** `usual`: the member of a plot that names none. */
export function sourcesOf(settings: Settings, usual: string): PlotSource[] {
  const more = Object.hasOwn(settings, "more") ? settings["more"] : undefined;
  const sources = [settings, ...(Array.isArray(more) ? more.filter(isSettings) : [])].map((each, i) => ({
    member: textIn(each, "member") || (i === 0 ? usual : ""),
    paths: textsIn(each, "paths"),
  }));
  const isNew = ({ member }: PlotSource, at: number): boolean =>
    sources.findIndex((each) => each.member === member) === at;
  return sources.filter((each, i) => i === 0 || (each.member !== "" && isNew(each, i))).slice(0, MOST_SOURCES);
}

/** The settings with these, and all else as it is. */
export function withSources(settings: Settings, sources: readonly PlotSource[]): Settings {
  const rest = Object.fromEntries(Object.entries(settings).filter(([name]) => !OWN.includes(name)));
  const [first, ...more] = sources.map(({ member, paths }) => ({ member, ...(paths.length > 0 && { paths }) }));
  return { ...rest, ...first, ...(more.length > 0 && { more }) };
}

/** The unit of all; "" where they differ, or one has none. */
export function sharedUnit(units: readonly string[]): string {
  const [first = ""] = units;
  return units.every((each) => each === first) ? first : "";
}

function isSettings(value: unknown): value is Settings {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}
