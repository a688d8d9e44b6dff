import {
  AT_REST,
  commandOf,
  Commands,
  deflectionOfGamepad,
  deflectionOfKeys,
  findGamepad,
  neutralTexts,
  partFor,
  readAxes,
  readNeutral,
  tell,
  together,
  worthOf,
} from "../../web/src/panels/teleop";
import type { Axis, Input } from "../../web/src/panels/teleop";
import { HeldSticks } from "../../web/src/panels/held_sticks";
import { numberIn } from "../../web/src/panels/panel";
import { Definitions } from "../../web/src/values/definitions";

const nothing = new Definitions([]);
const twist = new Definitions([
  "service a.b\nstruct Vector\nfield double x\nend\nstruct Twist\nfield Vector linear\nfield double[2] turn\nend\n",
]);
const up: Axis = { stick: "left-y", path: "velocity", scale: 200, deadZone: 0.1 };
const full = { ...AT_REST, "left-y": 1 };

describe("teleop", () => {
  it("does nothing in the dead zone, and goes evenly from there to the scale", () => {
    const worth = (y: number) => worthOf(up, { ...AT_REST, "left-y": y });
    expect([worth(0.1), worth(-0.05), worth(1), worth(-1)].map(Math.abs)).toEqual([0, 0, 200, 200]);
    expect(worth(-0.55)).toBeCloseTo(-100);
  });
  it("adds keys, pointers and gamepad up to full", () => {
    const keys = deflectionOfKeys(new Set(["KeyW", "KeyA", "ArrowLeft", "ArrowRight", "toString"]));
    expect(keys).toEqual({ "left-x": -1, "left-y": 1, "right-x": 0, "right-y": 0 });
    expect(together(keys, deflectionOfGamepad([0.5, -1, 0, 0.25, 1]))).toEqual({
      "left-x": -0.5,
      "left-y": 1,
      "right-x": 0,
      "right-y": -0.25,
    });
    expect(deflectionOfGamepad([Number.NaN])["left-x"]).toBe(0);
  });
  it("is at rest for a member whose sticks are, whatever others are pushed", () => {
    const pushed = { ...AT_REST, "left-y": 0.5, "right-x": 1 };
    expect(partFor([up], pushed)).toEqual({ ...AT_REST, "left-y": 0.5 });
    expect(partFor([{ ...up, stick: "left-x" }], pushed)).toBe(AT_REST);
    expect(partFor([], pushed)).toBe(AT_REST);
  });
  it("sets arguments by name, whole numbers rounded, beside the neutral ones", () => {
    const inputs = [
      { name: "velocity", type: "int16" },
      { name: "radius", type: "int16" },
    ];
    const neutral = [
      { kind: "text", text: "0" },
      { kind: "text", text: "32767" },
    ] as const;
    const mapping = { axes: [{ ...up, scale: 33.4 }], neutral };
    expect(commandOf(mapping, inputs, full, nothing, "")).toEqual([33, 32767]);
    expect(commandOf(mapping, inputs, AT_REST, nothing, "")).toEqual([0, 32767]);
  });
  it("reaches fields of structs and elements of arrays, with or without the name of the wire", () => {
    const inputs = [{ name: "command", type: "Twist" }];
    const axes = [
      { ...up, path: "command.linear.x", scale: 2 },
      { ...up, path: "turn[1]", scale: -1 },
    ];
    const [value] = commandOf({ axes, neutral: [] }, inputs, full, twist, "a.b") as [
      { linear: { x: number }; turn: Float64Array },
    ];
    expect([value.linear.x, ...value.turn]).toEqual([2, 0, -1]);
  });
  it("says which path leads to no number, and touches nothing that is not the value's own", () => {
    const inputs = [{ name: "command", type: "Twist" }];
    for (const path of ["", "linear", "linear.y", "turn[2]", "__proto__.x", "constructor.name", "turn.length"])
      expect(() => commandOf({ axes: [{ ...up, path }], neutral: [] }, inputs, full, twist, "a.b"), path).toThrow(
        `"${path}" is no number of Twist command`,
      );
  });
  it("takes from a file what are axes", () => {
    const axes = [up, null, 3, { stick: "middle", path: "x" }, { stick: "left-x", path: "y", scale: "9", deadZone: 7 }];
    expect(readAxes({ axes })).toEqual([up, { stick: "left-x", path: "y", scale: 1, deadZone: 0.9 }]);
    expect(readAxes({ axes: "none" })).toEqual([]);
  });
});

describe("at rest", () => {
  it("each parameter is told its own neutral value, wherever it stands", () => {
    const [speed, radius] = [
      { name: "speed", type: "double" },
      { name: "radius", type: "double" },
    ] as const;
    const settings = {
      neutral: neutralTexts(readNeutral({ neutral: ["0", "1000"] }, [speed, radius], nothing, ""), [speed, radius]),
    };
    const rest = (inputs: readonly Input[]) =>
      commandOf({ axes: [], neutral: readNeutral(settings, inputs, nothing, "") }, inputs, AT_REST, nothing, "");
    expect(rest([speed, radius])).toEqual([0, 1000]);
    expect(rest([radius, speed])).toEqual([1000, 0]);
    expect(rest([{ name: "toString", type: "double" }])).toEqual([0]);
  });

  const inputs = [{ name: "velocity", type: "double" }];
  const mapping = (path: string, text: string) => ({
    axes: [{ ...up, path }],
    neutral: [{ kind: "text", text } as const],
  });
  const given = (commands: Commands, path: string, text: string, deflection = AT_REST) =>
    commands.of(mapping(path, text), inputs, deflection, nothing, "");

  it("what is typed while it moves does not keep it from stopping", () => {
    const commands = new Commands();
    expect(given(commands, "velocity", "0", full)).toEqual([200]);
    expect(() => given(commands, "velo", "0", full)).toThrow('"velo" is no number');
    expect(given(commands, "velo", "0")).toEqual([0]);
    given(commands, "velocity", "1", full);
    given(commands, "velocity", "12", full);
    expect(given(commands, "velocity", "12")).toEqual([1]); // of when it began to move
    expect(given(commands, "velocity", "")).toEqual([1]);
    expect(given(commands, "velocity", "3")).toEqual([3]);
    expect(given(new Commands(), "velo", "0")).toEqual([0]);
    expect(() => given(new Commands(), "velocity", "")).toThrow("is not a number");
  });

  it.each([
    ["function", "urgent", "call"],
    ["wire", "setNow", "poke"],
    ["property", "setNow", "set"],
  ] as const)("a %s is told past what waits, and always with a deadline", async (kind, rest, move) => {
    const ways = ["call", "urgent", "set", "setNow", "poke"] as const;
    const object = Object.fromEntries(ways.map((way) => [way, vi.fn(() => Promise.resolve())]));
    const member = { name: "velocity", kind, type: "double", parameters: [], modifiers: [], documentation: "" };
    await tell(object as never, member, [0], true);
    await tell(object as never, member, [5], false);
    const wrapped = (value: number) => ["velocity", kind === "function" ? [value] : value, { timeout: 2_000 }];
    for (const way of ways)
      expect(object[way]?.mock.calls, way).toEqual(way === rest ? [wrapped(0)] : way === move ? [wrapped(5)] : []);
  });
});

describe("sticks that were let go of", () => {
  it("wait for a new press: of a key, and of a finger that is still down", () => {
    const held = new HeldSticks();
    held.pressKey("KeyW");
    held.press("right");
    expect(held.push("right", 1, 0)).toBe(true);
    expect(held.deflection).toEqual({ ...AT_REST, "left-y": 1, "right-x": 1 });
    held.letGo();
    expect(held.deflection).toEqual(AT_REST);
    expect(held.push("right", 1, 0.5)).toBe(false);
    expect(held.releaseKey("KeyW")).toBe(false);
    held.release("right");
    expect(held.deflection).toEqual(AT_REST);
    held.press("right");
    held.push("right", 0, -1);
    expect(held.deflection["right-y"]).toBe(-1);
    held.release("right");
    expect(held.deflection).toEqual(AT_REST);
  });
  it("wait, of a gamepad, until each axis was in the middle", () => {
    const held = new HeldSticks();
    held.poll([0, 0, 0, 0], true);
    expect(held.poll([0, -1, 0.5, 0], true)).toBe(true);
    held.letGo();
    held.poll([0, -1, 0.5, 0], true);
    held.poll([0, -0.9, 0.5, 0], true);
    expect(held.deflection).toEqual(AT_REST);
    held.poll([0, -0.9, 0, 0], true);
    held.poll([0, -0.8, 0.4, 0], true);
    expect(held.deflection).toEqual({ ...AT_REST, "right-x": 0.4 });
    held.poll([0, 0.01, 0.4, 0], true);
    held.poll([0, -0.8, 0.4, 0], true);
    expect(held.deflection).toEqual({ ...AT_REST, "left-y": 0.8, "right-x": 0.4 });
  });
  it("wait, too, when a gamepad is first seen, and when it was away", () => {
    const held = new HeldSticks();
    expect(held.poll([0, -1, 0, 0], true)).toBe(false);
    held.poll([0, 0, 0, 0], true);
    held.poll([0, -1, 0, 0], true);
    expect(held.deflection["left-y"]).toBe(1);
    held.poll(null, true);
    held.poll([0, -1, 0, 0], true);
    expect(held.deflection).toEqual(AT_REST);
  });
  it("are those of a gamepad whose axes are known", () => {
    const pad = (id: string, mapping: string, axes: number[]) => ({ id, mapping, axes, connected: true }) as never;
    const wheel = pad("Wheel", "", [0, 0, -1, -1]);
    expect(findGamepad([null, wheel])).toEqual({ axes: null, ignored: "Wheel" });
    expect(findGamepad([wheel, pad("Pad", "standard", [1, 0])])).toEqual({ axes: [1, 0], ignored: "" });
    expect(findGamepad([null])).toEqual({ axes: null, ignored: "" });
  });
  it("are free again past the middle, and where they may not drive", () => {
    const held = new HeldSticks();
    held.letGo();
    held.poll([0.08, 0, 0, 0], true); // worn: never read at 0
    held.poll([-0.3, 0, 0, 0], true);
    expect(held.deflection["left-x"]).toBe(-0.3);
    held.letGo();
    held.poll([1, 0, 0, 0], false);
    held.poll([0, 0, 0, 0], false);
    held.poll([1, 0, 0, 0], false);
    expect(held.deflection).toEqual(AT_REST);
    held.poll([1, 0, 0, 0], true);
    expect(held.deflection["left-x"]).toBe(1);
  });
});

test("numbers of a file or an address stay within what a panel allows", () => {
  for (const [percent, taken] of [
    [10_000, 100],
    [-5, 0],
    [Infinity, 10],
    ["50", 10],
    [50, 50],
  ])
    expect(numberIn({ percent }, "percent", 10, 0, 100), String(percent)).toBe(taken);
});
