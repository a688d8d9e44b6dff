// Models of robots in URDF: what is read of them, where their links are, and what is refused.
import { Window } from "happy-dom";
import { posesOfLinks, readUrdf } from "../../web/src/values/urdf";

Object.assign(globalThis, { DOMParser: new Window().DOMParser });

const rounded = (numbers: readonly number[] | undefined) => numbers?.map((each) => Math.round(each * 1e6) / 1e6 + 0);
const box = '<visual><geometry><box size="1 2 3"/></geometry></visual>';
const robot = (inside: string) => `<?xml version="1.0"?><robot name="r">${inside}</robot>`;
const joint = (parent: string, child: string, inside = "", type = "revolute", name = `${parent}-${child}`) =>
  `<joint name="${name}" type="${type}"><parent link="${parent}"/><child link="${child}"/>${inside}</joint>`;
const links = (...names: string[]) => names.map((name) => `<link name="${name}"/>`).join("");
const UPRIGHT = '<axis xyz="0 0 2"/>';

const placesOf = (text: string, positions: Record<string, number> = {}) => {
  const model = readUrdf(text);
  const poses = posesOfLinks(model, new Map(Object.entries(positions)));
  return Object.fromEntries(model.links.map(({ name }, i) => [name, rounded(poses[i]?.at)]));
};

it("links stand where their joints carry them, in whatever order they are written", () => {
  const arm = robot(
    joint("upper", "tool", '<origin xyz="0.4 0 0"/>', "fixed") +
      joint("base", "upper", `<origin xyz="0 0 0.1"/>${UPRIGHT}`) +
      links("tool", "upper", "base"),
  );
  expect(readUrdf(arm).links.map(({ name, parent }) => [name, parent])).toEqual([
    ["base", -1],
    ["upper", 0],
    ["tool", 1],
  ]);
  expect(placesOf(arm)).toEqual({ base: [0, 0, 0], upper: [0, 0, 0.1], tool: [0.4, 0, 0.1] });
  expect(placesOf(arm, { "base-upper": Math.PI / 2 })["tool"]).toEqual([0, 0.4, 0.1]);
  expect(placesOf(arm, { "base-upper": NaN })["tool"]).toEqual([0.4, 0, 0.1]);
});

it("revolute and continuous joints turn, prismatic ones slide along a direction of any length, others stay", () => {
  const after = (type: string) =>
    placesOf(
      robot(
        links("a", "b", "c") + joint("a", "b", UPRIGHT, type, "j") + joint("b", "c", '<origin xyz="1 0 0"/>', "fixed"),
      ),
      {
        j: Math.PI,
      },
    )["c"];
  expect(after("continuous")).toEqual([-1, 0, 0]);
  expect(after("prismatic")).toEqual([1, 0, 3.141593]);
  for (const type of ["fixed", "floating", "planar"]) expect(after(type)).toEqual([1, 0, 0]);
});

it("roll, pitch and yaw turn around the axes of the outer frame in this order; x is the axis of a joint without one", () => {
  const turned = '<origin rpy="1.5707963267948966 0 1.5707963267948966"/>';
  const text = (inside: string) =>
    robot(
      links("a", "b", "c") +
        joint("a", "b", inside, "revolute", "j") +
        joint("b", "c", '<origin xyz="0 1 0"/>', "fixed"),
    );
  expect(placesOf(text(turned))["c"]).toEqual([0, 0, 1]);
  expect(placesOf(text(turned), { j: Math.PI / 2 })["c"]).toEqual([1, 0, 0]);
});

it("reads shapes; for meshes it takes the simple ones for collisions, and counts them", () => {
  const shape = (kind: string, inside: string) =>
    `<${kind}><origin xyz="0 0 1"/><geometry>${inside}</geometry></${kind}>`;
  const mesh = shape("visual", '<mesh filename="package://r/a.stl"/>');
  const model = readUrdf(
    robot(
      `<link name="a">${box}${shape("visual", '<cylinder radius="0.1" length="2"/>')}${mesh}</link>` +
        `<link name="b">${mesh}${shape("collision", '<sphere radius="0.5"/>')}</link>` +
        joint("a", "b"),
    ),
  );
  expect(model.links.map(({ bodies }) => bodies.map((each) => each.shape))).toEqual([
    [
      { kind: "box", size: [1, 2, 3] },
      { kind: "cylinder", radius: 0.1, length: 2 },
    ],
    [{ kind: "sphere", radius: 0.5 }],
  ]);
  expect(model.links[1]?.bodies[0]?.pose.at).toEqual([0, 0, 1]);
  expect(model.meshes).toBe(2);
});

const many = (count: number, each: (i: number) => string) => Array.from({ length: count }, (_, i) => each(i)).join("");
const refused: Readonly<Record<string, [text: string, message: RegExp]>> = {
  "no XML": ["<robot", /^the model is no XML: /],
  "a text that is none": ["", /^the model is no XML: /],
  "another document": ["<html/>", /^the model begins with <html>, expected <robot>$/],
  entities: ['<!DOCTYPE r [<!ENTITY a "b">]><robot/>', /document type, expected URDF without one$/],
  xacro: [
    '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arm/></robot>',
    /^the model is a xacro file, expected the URDF/,
  ],
  nothing: [robot(""), /^the model has 0 links that no joint carries, expected one, the base$/],
  "two robots": [robot(links("a", "b")), /^the model has 2 links that no joint carries/],
  "a circle": [robot(links("a", "b") + joint("a", "b") + joint("b", "a")), /^the model has 0 links that no joint/],
  "a circle beside the base": [
    robot(links("base", "a", "b") + joint("a", "b") + joint("b", "a")),
    /^link "a" is in a circle of joints, expected a way from the base to it$/,
  ],
  "two joints at a link": [
    robot(links("a", "b", "c") + joint("a", "c") + joint("b", "c")),
    /^link "c" is carried by "a-c" and "b-c", expected one joint$/,
  ],
  "a link twice": [robot(links("a", "a")), /^there are two links "a", expected one$/],
  "an unknown link": [
    robot(links("a") + joint("a", "toString")),
    /^joint "a-toString": its child is "toString", expected a/,
  ],
  "an unknown joint": [
    robot(links("a", "b") + joint("a", "b", "", "toString")),
    /its type is "toString", expected one of rev/,
  ],
  "no axis": [
    robot(links("a", "b") + joint("a", "b", '<axis xyz="0 0 0"/>')),
    /its axis is 0 0 0, expected a direction$/,
  ],
  "two numbers": [
    robot(links("a", "b") + joint("a", "b", '<axis xyz="0 1"/>')),
    /xyz is "0 1", expected 3 numbers up to 1000$/,
  ],
  "far away": [robot(links("a", "b") + joint("a", "b", '<origin xyz="1e300 0 0"/>')), /xyz is "1e300 0 0", expected 3/],
  "a size that is none": [
    robot('<link name="a"><visual><geometry><sphere radius="-1"/></geometry></visual></link>'),
    /^link "a": radius of a sphere is -1, expected more than 0$/,
  ],
  "an unknown shape": [
    robot('<link name="a"><visual><geometry><torus/></geometry></visual></link>'),
    /^link "a": a shape is "torus", expected box, cylinder, sphere or mesh$/,
  ],
  "many links": [robot(many(501, (i) => `<link name="${i}"/>`)), /^the model has 501 links, expected at most 500$/],
  "many shapes": [
    robot(`<link name="a">${box.repeat(1001)}</link>`),
    /^the model has 1001 shapes, expected at most 1000$/,
  ],
  "a million links": [robot(many(1_000_000, () => "<link/>")), /characters, expected at most 1048576$/],
};
for (const [what, [text, message]] of Object.entries(refused))
  it(`refuses ${what}`, () => expect(() => readUrdf(text)).toThrow(message));

it("a message quotes at most 40 characters of a name", () => {
  const long = "x".repeat(1000);
  expect(() => readUrdf(robot(links(long, long)))).toThrow(`there are two links "${"x".repeat(40)}…", expected one`);
});
