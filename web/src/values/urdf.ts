// A robot's model in URDF: its links with their shapes, carried by joints that are moved by name. Of hostile text nothing runs, is
// fetched or grows: entities are refused, and sizes have limits. Layer: web/values, pure but for DOMParser.
// Source: wiki.ros.org/urdf/XML (link, joint).

import { about, compose, ORIGIN } from "./frames";
import type { Pose, Turn, Vector } from "./frames";

const MOST_CHARACTERS = 1024 * 1024;
const MOST_LINKS = 500;
const MOST_SHAPES = 1000;
const MOST_METRES = 1000;

/** Metres. A cylinder stands along z around its middle. */
export type Shape =
  | { kind: "box"; size: Vector }
  | { kind: "cylinder"; radius: number; length: number }
  | { kind: "sphere"; radius: number };

/** A shape where it is. */
export interface Body {
  shape: Shape;
  pose: Pose;
}

export interface Link {
  name: string;
  /** In `Model.links`, where it is before its children; -1 for the first link, that of the base. */
  parent: number;
  /** What carries it; null for the first link. */
  joint: Joint | null;
  /** In the link's frame. */
  bodies: readonly Body[];
}

interface Joint {
  name: string;
  moves: "turns" | "slides" | "no";
  axis: Vector;
  origin: Pose;
}

export interface Model {
  links: readonly Link[];
  /** Shapes that are files of their own, which are not shown. */
  meshes: number;
}

/** @throws Error when it is no such model, with what was found where, and what was expected. */
export function readUrdf(text: string): Model {
  if (text.length > MOST_CHARACTERS)
    throw new Error(`the model has ${text.length} characters, expected at most ${MOST_CHARACTERS}`);
  if (/<!(DOCTYPE|ENTITY)/i.test(text))
    throw new Error("the model declares a document type, expected URDF without one");
  const parsed = new DOMParser().parseFromString(text, "application/xml");
  const wrong = parsed.getElementsByTagName("parsererror")[0];
  if (wrong) throw new Error(`the model is no XML: ${shorten(wrong.textContent.replaceAll(/\s+/g, " ").trim(), 160)}`);
  const robot = parsed.documentElement;
  if (robot.localName !== "robot")
    throw new Error(`the model begins with <${shorten(robot.localName)}>, expected <robot>`);
  if (Array.from(robot.children).some(({ prefix }) => prefix === "xacro"))
    throw new Error("the model is a xacro file, expected the URDF that xacro makes of it");
  const links = childrenOf(robot, "link");
  if (links.length > MOST_LINKS) throw new Error(`the model has ${links.length} links, expected at most ${MOST_LINKS}`);
  const shapes = links.map((link) => ({ name: nameOf(link), ...shapesOf(link) }));
  const count = shapes.reduce((sum, { bodies }) => sum + bodies.length, 0);
  if (count > MOST_SHAPES) throw new Error(`the model has ${count} shapes, expected at most ${MOST_SHAPES}`);
  return {
    links: inOrder(shapes, childrenOf(robot, "joint")),
    meshes: shapes.reduce((sum, { meshes }) => sum + meshes, 0),
  };
}

/** Where each link is, in the frame of the first one. `positions`: of joints by name, in radians and metres; others are at 0. */
export function posesOfLinks({ links }: Model, positions: ReadonlyMap<string, number>): Pose[] {
  const poses: Pose[] = [];
  for (const { parent, joint } of links) {
    if (!joint) {
      poses.push(ORIGIN);
      continue;
    }
    const { axis, origin, moves } = joint;
    const given = positions.get(joint.name) ?? 0;
    const by = moves !== "no" && Number.isFinite(given) ? given : 0;
    const moved: Pose =
      moves === "slides"
        ? { at: [axis[0] * by, axis[1] * by, axis[2] * by], turn: ORIGIN.turn }
        : { at: ORIGIN.at, turn: about(axis, by) };
    poses.push(compose(compose(poses[parent] ?? ORIGIN, origin), moved));
  }
  return poses;
}

type Shaped = Pick<Link, "name" | "bodies">;

/** From the base: what each joint carries comes after what carries the joint. */
function inOrder(shaped: readonly Shaped[], tags: readonly Element[]): Link[] {
  const byName = new Map<string, Shaped>();
  for (const link of shaped) {
    if (byName.has(link.name)) throw new Error(`there are two links ${quote(link.name)}, expected one`);
    byName.set(link.name, link);
  }
  const carried = new Map<string, { link: Shaped; joint: Joint }[]>();
  const carriers = new Map<string, string>();
  for (const tag of tags) {
    const joint = readJoint(tag);
    const [parent, link] = ["parent", "child"].map((end) => {
      const name = childrenOf(tag, end)[0]?.getAttribute("link") ?? "";
      const found = byName.get(name);
      if (!found)
        throw new Error(`joint ${quote(joint.name)}: its ${end} is ${quote(name)}, expected a link of the model`);
      return found;
    }) as [Shaped, Shaped];
    const other = carriers.get(link.name);
    if (other !== undefined)
      throw new Error(
        `link ${quote(link.name)} is carried by ${quote(other)} and ${quote(joint.name)}, expected one joint`,
      );
    carriers.set(link.name, joint.name);
    carried.set(parent.name, [...(carried.get(parent.name) ?? []), { link, joint }]);
  }
  const bases = shaped.filter(({ name }) => !carriers.has(name));
  const base = bases[0];
  if (!base || bases.length > 1)
    throw new Error(`the model has ${bases.length} links that no joint carries, expected one, the base`);
  const links: Link[] = [{ name: base.name, bodies: base.bodies, parent: -1, joint: null }];
  for (let parent = 0; parent < links.length; ++parent)
    for (const { link, joint } of carried.get(links[parent]?.name ?? "") ?? [])
      links.push({ name: link.name, bodies: link.bodies, parent, joint });
  const missing = shaped.find(({ name }) => !links.some((link) => link.name === name));
  if (missing)
    throw new Error(`link ${quote(missing.name)} is in a circle of joints, expected a way from the base to it`);
  return links;
}

const MOVES: Readonly<Record<string, Joint["moves"]>> = {
  revolute: "turns",
  continuous: "turns",
  prismatic: "slides",
  fixed: "no",
  floating: "no", // has no one position
  planar: "no",
};

function readJoint(tag: Element): Joint {
  const name = nameOf(tag);
  const type = tag.getAttribute("type") ?? "";
  const moves = Object.hasOwn(MOVES, type) ? MOVES[type] : undefined;
  if (!moves)
    throw new Error(
      `joint ${quote(name)}: its type is ${quote(type)}, expected one of ${Object.keys(MOVES).join(", ")}`,
    );
  const where = `joint ${quote(name)}`;
  const given = childrenOf(tag, "axis")[0];
  const [x, y, z] = given ? readVector(given, "xyz", where) : ([1, 0, 0] as const);
  const length = Math.hypot(x, y, z);
  if (length === 0) throw new Error(`${where}: its axis is 0 0 0, expected a direction`);
  return { name, moves, axis: [x / length, y / length, z / length], origin: readOrigin(tag, where) };
}

/** What is seen of it; where that is all in files, the simpler shapes for collisions. */
function shapesOf(link: Element): { bodies: Body[]; meshes: number } {
  const where = `link ${quote(nameOf(link))}`;
  const read = (kind: string): (Body | null)[] => childrenOf(link, kind).map((tag) => readBody(tag, where));
  const seen = read("visual");
  const meshes = seen.filter((body) => body === null).length;
  const bodies = meshes > 0 && meshes === seen.length ? read("collision") : seen;
  return { bodies: bodies.filter((body) => body !== null), meshes };
}

/** null: a mesh. */
function readBody(tag: Element, where: string): Body | null {
  const shape = childrenOf(tag, "geometry")[0]?.children[0];
  const kind = shape?.localName ?? "";
  if (kind === "mesh") return null;
  const pose = readOrigin(tag, where);
  const size = (name: string): number => {
    const [value = 0] = numbersIn(shape, name, 1, where);
    if (value <= 0) throw new Error(`${where}: ${name} of a ${kind} is ${value}, expected more than 0`);
    return value;
  };
  if (kind === "box") return { shape: { kind, size: readVector(shape, "size", where) }, pose };
  if (kind === "cylinder") return { shape: { kind, radius: size("radius"), length: size("length") }, pose };
  if (kind === "sphere") return { shape: { kind, radius: size("radius") }, pose };
  throw new Error(`${where}: a shape is ${quote(kind)}, expected box, cylinder, sphere or mesh`);
}

/** Turned around x, then y, then z of the outer frame. */
function readOrigin(tag: Element, where: string): Pose {
  const origin = childrenOf(tag, "origin")[0];
  const [roll, pitch, yaw] = readVector(origin, "rpy", where, ORIGIN.at);
  const turns: Turn[] = [about([0, 0, 1], yaw), about([0, 1, 0], pitch), about([1, 0, 0], roll)];
  const { turn } = turns.map((each): Pose => ({ at: ORIGIN.at, turn: each })).reduce(compose);
  return { at: readVector(origin, "xyz", where, ORIGIN.at), turn };
}

function readVector(tag: Element | undefined, name: string, where: string, otherwise?: Vector): Vector {
  if (otherwise && !tag?.hasAttribute(name)) return otherwise;
  return numbersIn(tag, name, 3, where) as [number, number, number];
}

function numbersIn(tag: Element | undefined, name: string, count: number, where: string): number[] {
  const text = tag?.getAttribute(name)?.trim() ?? "";
  const values = text.split(/\s+/).map((each) => (each === "" ? NaN : Number(each)));
  if (values.length !== count || !values.every((each) => Math.abs(each) <= MOST_METRES))
    throw new Error(
      `${where}: ${name} is ${quote(text)}, expected ${count === 1 ? "a number" : `${count} numbers`} up to ${MOST_METRES}`,
    );
  return values;
}

function childrenOf(tag: Element, kind: string): Element[] {
  return Array.from(tag.children).filter(({ localName }) => localName === kind);
}

function nameOf(tag: Element): string {
  return tag.getAttribute("name") ?? "";
}

function quote(text: string): string {
  return JSON.stringify(shorten(text));
}

function shorten(text: string, most = 40): string {
  return text.length > most ? `${text.slice(0, most)}…` : text;
}
