// What a board is, and its forms: in the address, in this browser's storage, as a file.
// Layer: web/board, pure but for the storage.

import { COLUMNS, MOST_COLUMNS, settle } from "./layout";
import type { Placed } from "./layout";
import type { StopCall } from "../robot/stop";

export const PANEL_KINDS = [
  "plot",
  "table",
  "image",
  "form",
  "log",
  "robot",
  "trajectory",
  "scene",
  "teleop",
  "pipe",
  "memory",
  "generator",
  "streams",
  "locks",
  "notes",
] as const;
export type PanelKind = (typeof PANEL_KINDS)[number];

export type Settings = Readonly<Record<string, unknown>>;

export interface Panel extends Placed {
  kind: PanelKind;
  /** "" for the kind's own. */
  title: string;
  /** Whose members it shows: "" for the service of the page, else "device/service". */
  from: string;
  /** The object: "" for the root, else "Webcams[0]". */
  object: string;
  settings: Settings;
}

export interface Board {
  panels: readonly Panel[];
  /** For which the panels were arranged. */
  columns: number;
  stop: StopCall | null;
}

export const MOST_PANELS = 64;
const MOST_TEXT = 1024 * 1024; // with some models of robots

/** @throws Error with what is wrong, where, and what was expected. */
function readBoard(json: unknown): Board {
  const { board, panels, columns = COLUMNS, stop } = record(json, "the file");
  if (board !== 1) throw new Error(`the file: field "board" is ${say(board)}, expected 1 (a board of this page)`);
  if (!Array.isArray(panels)) throw new Error(`the file: field "panels" is ${say(panels)}, expected a list`);
  if (panels.length > MOST_PANELS)
    throw new Error(`the file: ${panels.length} panels, expected at most ${MOST_PANELS}`);
  if (typeof columns !== "number" || !Number.isInteger(columns) || columns < COLUMNS || columns > MOST_COLUMNS)
    throw new Error(
      `the file: field "columns" is ${say(columns)}, expected a whole number from ${COLUMNS} to ${MOST_COLUMNS}`,
    );
  return {
    panels: settle(panels.map(readPanel), columns),
    columns,
    stop: stop === undefined || stop === null ? null : readStop(stop),
  };
}

export function writeBoard({ panels, columns, stop }: Board): object {
  return {
    board: 1,
    ...(columns !== COLUMNS && { columns }),
    ...(stop && { stop }),
    panels: panels.map(({ id: _, title, from, object, settings, ...rest }) => ({
      ...rest,
      ...(title !== "" && { title }),
      ...(from !== "" && { from }),
      ...(object !== "" && { object }),
      ...(Object.keys(settings).length > 0 && { settings }),
    })),
  };
}

/** Whether both are the same for who looks at them. */
export function sameBoard(a: Board, b: Board): boolean {
  return a === b || JSON.stringify(writeBoard(a)) === JSON.stringify(writeBoard(b));
}

/** For an address: letters, digits, "-" and "_". */
export function packBoard(board: Board): string {
  const bytes = new TextEncoder().encode(JSON.stringify(writeBoard(board)));
  return btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""))
    .replaceAll("+", "-")
    .replaceAll("/", "_")
    .replace(/=+$/, "");
}

/** @throws Error when it is no board. */
export function unpackBoard(text: string): Board {
  let bytes: Uint8Array;
  try {
    bytes = Uint8Array.from(atob(text.replaceAll("-", "+").replaceAll("_", "/")), (c) => c.charCodeAt(0));
  } catch (error) {
    throw new Error("the address: the board in it is cut off or changed", { cause: error });
  }
  return parseBoard(new TextDecoder().decode(bytes));
}

/** @throws Error when it is no board. */
export function parseBoard(text: string): Board {
  if (text.length > MOST_TEXT) throw new Error(`the file has ${text.length} characters, expected at most ${MOST_TEXT}`);
  let json: unknown;
  try {
    json = JSON.parse(text);
  } catch (error) {
    throw new Error(`the file is no JSON: ${(error as Error).message}`, { cause: error });
  }
  return readBoard(json);
}

/** As a file, which people may read. */
export function formatBoard(board: Board): string {
  return `${JSON.stringify(writeBoard(board), null, 2)}\n`;
}

/** Its file could not be read again. */
export function isTooLong(board: Board): boolean {
  return formatBoard(board).length > MOST_TEXT;
}

/** The board that this browser keeps for a page; null where there is none that can be read. */
export function recallBoard(key: string, storage: Pick<Storage, "getItem"> = localStorage): Board | null {
  try {
    const text = storage.getItem(`rrgate-board:${key}`);
    return text === null ? null : parseBoard(text);
  } catch {
    return null; // storage is forbidden, or of an older page: the preset takes its place
  }
}

/** null: forgets it. */
export function keepBoard(key: string, board: Board | null, storage: Storage = localStorage): void {
  try {
    if (board === null) storage.removeItem(`rrgate-board:${key}`);
    else storage.setItem(`rrgate-board:${key}`, JSON.stringify(writeBoard(board)));
  } catch {
    // Storage may be forbidden or full; the address still has the board.
  }
}

let made = 0;

export function makeId(): string {
  return `p${++made}`;
}

function readPanel(json: unknown, index: number): Panel {
  const where = `/panels/${index}`;
  const given = record(json, where);
  const { kind, settings = {} } = given;
  if (!PANEL_KINDS.includes(kind as PanelKind))
    throw new Error(`${where}/kind is ${say(kind)}, expected one of ${PANEL_KINDS.join(", ")}`);
  const number = (name: string): number => {
    const value = given[name];
    if (typeof value !== "number" || !Number.isInteger(value) || value < 0)
      throw new Error(`${where}/${name} is ${say(value)}, expected a whole number from 0`);
    return value;
  };
  const text = (name: string): string => {
    const value = given[name] ?? "";
    if (typeof value !== "string") throw new Error(`${where}/${name} is ${say(value)}, expected a text`);
    return value;
  };
  const from = text("from");
  if (!isPlace(from)) throw new Error(`${where}/from is ${say(from)}, expected "device/service", each percent-encoded`);
  return {
    id: makeId(),
    kind: kind as PanelKind,
    title: text("title"),
    from,
    object: text("object"),
    x: number("x"),
    y: number("y"),
    w: number("w"),
    h: number("h"),
    settings: record(settings, `${where}/settings`),
  };
}

/** Whether it names a service, or none. */
function isPlace(from: string): boolean {
  try {
    return from === "" || from.split("/").map(decodeURIComponent).filter(Boolean).length === 2;
  } catch {
    return false;
  }
}

function readStop(json: unknown): StopCall {
  const { call, args = [], set } = record(json, "/stop");
  if (typeof call !== "string") throw new Error(`/stop/call is ${say(call)}, expected the name of a function`);
  if (!Array.isArray(args) || args.some((each) => typeof each !== "number"))
    throw new Error(`/stop/args is ${say(args)}, expected a list of numbers`);
  if (set === undefined) return { call, args: args as number[] };
  const { property, value } = record(set, "/stop/set");
  if (typeof property !== "string" || typeof value !== "number")
    throw new Error(`/stop/set is ${say(set)}, expected {"property": name, "value": number}`);
  return { call, args: args as number[], set: { property, value } };
}

function record(json: unknown, where: string): Record<string, unknown> {
  if (typeof json !== "object" || json === null || Array.isArray(json))
    throw new Error(`${where} is ${say(json)}, expected an object { … }`);
  return json as Record<string, unknown>;
}

function say(value: unknown): string {
  const text = JSON.stringify(value) ?? "missing";
  return text.length > 40 ? `${text.slice(0, 40)}…` : text;
}
