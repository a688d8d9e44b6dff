// Mirrors web/src/panels/waypoints.ts.
import { trajectoryThrough, waypointsIn } from "../../web/src/panels/waypoints";

const joints = ["a", "b"].map((name) => ({ name, unit: "rad", low: -3, high: 3, fastest: 2 }));

test("a trajectory passes through all waypoints, with a stop at each, in steps that a driver takes", () => {
  const trajectory = trajectoryThrough(
    [0, 1],
    [
      { seconds: 1, positions: [0.5, 1] },
      { seconds: 1.5, positions: [0.5, 0.5] },
    ],
    joints,
  );
  const points = trajectory.waypoints.map((each) => [each.time_from_start, ...each.joint_position] as const);
  expect(points[0]).toEqual([0, 0, 1]);
  expect(points.find(([seconds]) => Math.abs(seconds - 1) < 1e-9)?.slice(1)).toEqual([0.5, 1]);
  expect(points.at(-1)).toEqual([1.5, 0.5, 0.5]);
  const speeds = points.slice(1).map(([seconds, ...place], i) => {
    const [before = NaN, ...was] = points[i] ?? [];
    expect(seconds - before).toBeGreaterThan(0);
    expect(seconds - before).toBeLessThanOrEqual(0.0201);
    return Math.max(...place.map((each, joint) => Math.abs(each - (was[joint] ?? NaN)))) / (seconds - before);
  });
  expect(Math.max(...speeds)).toBeLessThanOrEqual(2);
  expect(speeds.filter((speed) => speed < 0.1).length).toBeGreaterThanOrEqual(4); // at the ends, and at the stop between them
  expect(trajectory.waypoints.map((each) => each.waypoint_type).filter((type) => type !== 2)).toEqual([1, 3]);
  expect(trajectory.joint_names).toEqual(["a", "b"]);
});

test("what a robot could not do is refused, with the waypoint, the joint and the limit", () => {
  const run = (...waypoints: { seconds: number; positions: number[] }[]) =>
    trajectoryThrough([0, 0], waypoints, joints);
  expect(() => run()).toThrow("There is no waypoint to go to.");
  expect(() => run({ seconds: 2, positions: [1, 3.5] })).toThrow("Waypoint 1: b is 3.5, its limits are -3 to 3 rad.");
  expect(() => run({ seconds: 1, positions: [1.5, 0] })).toThrow(
    "Waypoint 1: a would move at 2.25 rad/s, it can move at 2.",
  );
  expect(() => run({ seconds: 1, positions: [0, 0] }, { seconds: 1, positions: [0, 0] })).toThrow(
    "Waypoint 2 must be at least 0.2 s after the one before.",
  );
  expect(() => run({ seconds: 1000, positions: [0, 0] })).toThrow("Waypoint 1 is later than 600 s.");
});

test("waypoints out of a file or an address are numbers, at least as many as there are joints", () => {
  const waypoints = [
    { seconds: 1, positions: [1] },
    null,
    { seconds: "2", positions: [] },
    { seconds: 3, positions: ["x", 2, 3] },
  ];
  expect(waypointsIn({ waypoints }, 2)).toEqual([
    { seconds: 1, positions: [1, 0] },
    { seconds: 3, positions: [0, 2, 3] },
  ]);
  expect(waypointsIn({ waypoints: "all" }, 2)).toEqual([]);
});

test("waypoints keep all of their positions where the joints are not known, and when they are written back", () => {
  const stored = { waypoints: [{ seconds: 1, positions: [0.5, -1] }] };
  const back = { waypoints: waypointsIn(stored, 0) };
  expect(waypointsIn(back, 2)).toEqual([{ seconds: 1, positions: [0.5, -1] }]);
  expect(waypointsIn(back, 3)).toEqual([{ seconds: 1, positions: [0.5, -1, 0] }]);
});
