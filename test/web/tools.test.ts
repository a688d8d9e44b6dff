// Jogging a standard robot's tool: its speeds, the velocities that are sent, where it is.
import { coordinateOf, toolsOf, velocityAlong } from "../../web/src/panels/tools";

const velocity = (linear: number, angular: number) => ({
  linear: { x: linear, y: 2 * linear, z: 3 * linear },
  angular: { x: angular, y: angular, z: angular },
});
const chain = (more: object) => ({ kin_chain_identifier: { name: "arm" }, ...more });

it("takes the reduced speed of an axis, else the greatest, else the reduced speed of the standard", () => {
  const [slow, fast, silent] = toolsOf({
    chains: [
      chain({ tcp_reduced_max_velocity: velocity(0.1, 0.2), tcp_max_velocity: velocity(1, 2) }),
      chain({ tcp_reduced_max_velocity: velocity(0, 0), tcp_max_velocity: velocity(1, 2) }),
      { tcp_max_velocity: { linear: { x: NaN } } },
    ],
  });
  expect(slow).toEqual({
    name: "arm",
    isJogged: false,
    fastest: { X: 0.1, Y: 0.2, Z: expect.closeTo(0.3), RX: 0.2, RY: 0.2, RZ: 0.2 },
  });
  expect(fast?.fastest).toEqual({ X: 1, Y: 2, Z: 3, RX: 2, RY: 2, RZ: 2 });
  expect(silent).toEqual({
    name: "3",
    isJogged: false,
    fastest: { X: 0.25, Y: 0.25, Z: 0.25, RX: 0.5, RY: 0.5, RZ: 0.5 },
  });
});

it("are jogged only where the robot says that it can be", () => {
  const isJogged = (flags: unknown) => toolsOf({ chains: [{}], ["robot_capabilities"]: flags })[0]?.isJogged;
  expect([1, 0x401, 0, 0x406, undefined].map(isJogged)).toEqual([true, true, false, false, false]);
});

it("finds no tools in what is no RobotInfo", () => {
  for (const info of [null, undefined, 7, {}, { chains: "arm" }]) expect(toolsOf(info)).toEqual([]);
});

it("moves along one axis, or about it, and not otherwise", () => {
  const still = { x: 0, y: 0, z: 0 };
  expect(velocityAlong("Y", -0.2)).toEqual({ linear: { x: 0, y: -0.2, z: 0 }, angular: still });
  expect(velocityAlong("RZ", 0.5)).toEqual({ linear: still, angular: { x: 0, y: 0, z: 0.5 } });
});

it("says where the tool is, and how it is turned", () => {
  const half = Math.SQRT1_2;
  const pose = { at: [1, 2, 3], turn: [half, 0, 0, half] } as const;
  expect(coordinateOf(pose, "Z")).toBe(3);
  expect(coordinateOf(pose, "RZ")).toBeCloseTo(90);
  expect(coordinateOf(pose, "RX")).toBeCloseTo(0);
  expect(coordinateOf({ at: [0, 0, 0], turn: [half, 0, half, 0] }, "RY")).toBeCloseTo(90);
  expect(coordinateOf({ at: [0, 0, 0], turn: [half, half, 0, 0] }, "RX")).toBeCloseTo(90);
});
