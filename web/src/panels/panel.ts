// What every panel is given, and which kinds there are; each is loaded when a board has one.
// Layer: web/panels.

import type { ComponentType } from "preact";
import type { Place } from "../app/router";
import type { PanelKind, Settings } from "../board/board";
import { isGenerator } from "../robot/remote";
import type { Member, MemberKind, Remote } from "../robot/remote";
import type { Definitions } from "../values/definitions";

export interface PanelProps {
  /** The panel's object; null while there is no connection. */
  object: Remote | null;
  /** The same for a stop: also while the device is only said to be away. */
  reach: Remote | null;
  /**
   * A stop where `reach` is null or nothing comes back over it, by what the gateway does to make the device safe.
   * `cause`: what came of the stop by `reach`.
   * @returns how it went, in words. @throws (rejects) why it may not have arrived.
   */
  stopWithout: (cause?: unknown) => Promise<string>;
  /** What was last known of it, also without connection. */
  members: readonly Member[];
  definitions: Definitions;
  /** The definition in which the types of its members are named. */
  scope: string;
  /** Address of the object for examples of code. */
  place: Place;
  settings: Settings;
  change: (settings: Settings) => void;
}

interface KindOfPanel {
  title: string;
  load: () => Promise<{ default: ComponentType<PanelProps> }>;
  /** In cells of the board. */
  w: number;
  h: number;
  /** Kinds of members that it shows; empty: none is chosen. */
  members: readonly MemberKind[];
  /** Of these, those that it can show. */
  fits?: (member: Member) => boolean;
}

const notWriteOnly = (member: Member): boolean => !member.modifiers.includes("writeonly");

const takesValues = (member: Member): boolean =>
  !isGenerator(member) && (member.kind !== "function" || member.parameters.length > 0);

export const KINDS: Readonly<Record<PanelKind, KindOfPanel>> = {
  plot: {
    title: "Plot",
    load: () => import("./plot_panel"),
    w: 6,
    h: 8,
    members: ["wire", "property", "pipe"],
    fits: notWriteOnly,
  },
  table: {
    title: "Values",
    load: () => import("./table_panel"),
    w: 4,
    h: 8,
    members: ["wire", "property", "pipe"],
    fits: notWriteOnly,
  },
  image: {
    title: "Image",
    load: () => import("./image_panel"),
    w: 6,
    h: 9,
    members: ["pipe", "wire", "function", "property"],
    fits: (member) => notWriteOnly(member) && member.parameters.length === 0,
  },
  form: {
    title: "Form",
    load: () => import("./form_panel"),
    w: 4,
    h: 8,
    members: ["function", "property", "wire"],
    fits: (member) => !isGenerator(member) && (member.kind !== "wire" || !member.modifiers.includes("readonly")),
  },
  log: { title: "Events", load: () => import("./log_panel"), w: 4, h: 6, members: [] },
  robot: { title: "Joints", load: () => import("./robot_panel"), w: 6, h: 10, members: [] },
  trajectory: { title: "Trajectory", load: () => import("./trajectory_panel"), w: 6, h: 9, members: [] },
  scene: {
    title: "3-D",
    load: () => import("./scene_panel"),
    w: 6,
    h: 10,
    members: ["wire", "property", "pipe"],
    fits: notWriteOnly,
  },
  teleop: {
    title: "Teleop",
    load: () => import("./teleop_panel"),
    w: 4,
    h: 12,
    members: ["function", "wire", "property"],
    fits: (member) => takesValues(member) && !member.modifiers.includes("readonly"),
  },
  pipe: { title: "Pipe", load: () => import("./pipe_panel"), w: 4, h: 7, members: ["pipe"] },
  memory: { title: "Memory", load: () => import("./memory_panel"), w: 6, h: 9, members: ["memory"] },
  generator: {
    title: "Generator",
    load: () => import("./generator_panel"),
    w: 4,
    h: 8,
    members: ["function"],
    fits: isGenerator,
  },
  streams: { title: "Streams", load: () => import("./streams_panel"), w: 6, h: 6, members: [] },
  locks: { title: "Lock", load: () => import("./locks_panel"), w: 3, h: 5, members: [] },
  notes: { title: "Notes", load: () => import("./notes_panel"), w: 3, h: 5, members: [] },
};

/** The members of an object that a panel can show. */
export function membersFor(kind: PanelKind, members: readonly Member[]): Member[] {
  const { members: kinds, fits = () => true } = KINDS[kind];
  return members.filter((member) => kinds.includes(member.kind) && fits(member));
}

/** What is given to a member: a function's arguments, or the one value of the others. */
export function inputsOf(member: Member): readonly { name: string; type: string }[] {
  return member.kind === "function" ? member.parameters : [{ name: member.name, type: member.type }];
}

/** A text of the settings; "" where there is none. */
export function textIn(settings: Settings, name: string): string {
  const value = Object.hasOwn(settings, name) ? settings[name] : undefined;
  return typeof value === "string" ? value : "";
}

export function textsIn(settings: Settings, name: string): string[] {
  const value = Object.hasOwn(settings, name) ? settings[name] : undefined;
  return Array.isArray(value) ? value.filter((each): each is string => typeof each === "string") : [];
}

/** A number of the settings, which may come from a file or an address: from `least` to `most`. */
export function numberIn(settings: Settings, name: string, otherwise: number, least: number, most: number): number {
  const value = Object.hasOwn(settings, name) ? settings[name] : undefined;
  return typeof value === "number" && Number.isFinite(value) ? Math.min(most, Math.max(least, value)) : otherwise;
}
