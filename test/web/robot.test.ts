// What the demo robot tells and where that puts it; how directions become commands.
import { Holds } from "../../web/src/robot/holds";
import { advance, ORIGIN, Reckoner, wrapAngle } from "../../web/src/robot/reckoning";
import { RobotModel } from "../../web/src/robot/robot_model";
import { loopsOf, obstaclesOf, poseOf, wallsOf } from "../../web/src/robot/room";
import { readSensorPacket } from "../../web/src/robot/sensor_packet";
import { Series } from "../../web/src/robot/series";
import { nameNotes, songAfter } from "../../web/src/robot/song";
import {
  commandFor,
  directionOfKey,
  SPIN_LEFT,
  SPIN_RIGHT,
  STOP,
  STRAIGHT,
  TURN_RADIUS,
} from "../../web/src/robot/steering";
import type { Direction } from "../../web/src/robot/steering";
import { Trail } from "../../web/src/robot/trail";

describe("dead reckoning", () => {
  it("drives straight along the heading", () => {
    const pose = advance({ x: 1, y: 1, theta: Math.PI / 2 }, 2, 0);
    expect(pose.x).toBeCloseTo(1);
    expect(pose.y).toBeCloseTo(3);
  });
  it("drives arcs exactly: a quarter circle of radius 1 to the left ends at (1, 1) looking north", () => {
    const pose = advance(ORIGIN, Math.PI / 2, Math.PI / 2);
    expect(pose.x).toBeCloseTo(1, 12);
    expect(pose.y).toBeCloseTo(1, 12);
    expect(pose.theta).toBeCloseTo(Math.PI / 2, 12);
  });
  it("comes back to the start after a full circle in steps of a degree", () => {
    const reckoner = new Reckoner();
    for (let degree = 0; degree <= 360; degree++) reckoner.update((2000 * Math.PI * degree) / 360, degree);
    expect(reckoner.pose.x).toBeCloseTo(0, 6);
    expect(reckoner.pose.y).toBeCloseTo(0, 6);
    expect(Math.abs(reckoner.pose.theta)).toBeCloseTo(0, 6);
  });
  it("takes the first counters, and those after a restart, as a baseline only", () => {
    const reckoner = new Reckoner();
    reckoner.update(5000, 90);
    expect(reckoner.pose).toEqual(ORIGIN);
    reckoner.update(6000, 90);
    expect(reckoner.pose.x).toBeCloseTo(1);
    reckoner.rebase();
    reckoner.update(0, 0);
    reckoner.update(500, 0);
    expect(reckoner.pose.x).toBeCloseTo(1.5);
  });
  it("keeps angles between -180 and 180 degrees", () => {
    expect(wrapAngle(3 * Math.PI)).toBeCloseTo(Math.PI);
    expect(wrapAngle(-Math.PI - 0.1)).toBeCloseTo(Math.PI - 0.1);
    expect(wrapAngle(0)).toBe(0);
  });
});

describe("steering", () => {
  const held = (...directions: Direction[]): Set<Direction> => new Set(directions);
  it("turns directions into velocity and radius of the Create", () => {
    expect(commandFor(held(), 200)).toEqual(STOP);
    expect(commandFor(held("forward"), 200)).toEqual({ velocity: 200, radius: STRAIGHT });
    expect(commandFor(held("back"), 200)).toEqual({ velocity: -200, radius: STRAIGHT });
    expect(commandFor(held("forward", "left"), 200)).toEqual({ velocity: 200, radius: TURN_RADIUS });
    expect(commandFor(held("forward", "right"), 200)).toEqual({ velocity: 200, radius: -TURN_RADIUS });
    expect(commandFor(held("left"), 200)).toEqual({ velocity: 100, radius: SPIN_LEFT });
    expect(commandFor(held("right"), 200)).toEqual({ velocity: 100, radius: SPIN_RIGHT });
  });
  it("stops where directions contradict each other", () => {
    expect(commandFor(held("forward", "back"), 200)).toEqual(STOP);
    expect(commandFor(held("left", "right"), 200)).toEqual(STOP);
    expect(commandFor(held("forward", "left", "right"), 200)).toEqual({ velocity: 200, radius: STRAIGHT });
  });
  it("knows arrows and WASD", () => {
    expect(directionOfKey("ArrowUp")).toBe("forward");
    expect(directionOfKey("KeyA")).toBe("left");
    expect(directionOfKey("KeyQ")).toBeUndefined();
  });
  it("holds a direction as long as any finger or key does", () => {
    const holds = new Holds();
    holds.press("KeyW", "forward");
    holds.press("ArrowUp", "forward");
    holds.release("KeyW");
    expect([...holds.directions]).toEqual(["forward"]);
    holds.press("pointer 1", "left");
    holds.clear();
    expect([...holds.directions]).toEqual([]);
  });
});

describe("sensor packets", () => {
  it("reads the wheels and bumpers out of the group of all sensors", () => {
    const bytes = new Uint8Array(52);
    const view = new DataView(bytes.buffer);
    bytes[0] = 0b111;
    view.setUint16(17, 16_100);
    view.setInt16(48, -120);
    view.setInt16(50, 250);
    expect(readSensorPacket(6, bytes)).toEqual({
      bumpers: 3,
      voltageMv: 16_100,
      chargeMah: 0,
      rightWheelMmS: -120,
      leftWheelMmS: 250,
    });
  });
  it("reads a single packet, at an unaligned place too", () => {
    const bytes = Uint8Array.of(9, 0xff, 0x88).subarray(1);
    expect(readSensorPacket(42, bytes)).toEqual({ leftWheelMmS: -120 });
  });
  it("reads nothing from unknown or misshapen packets", () => {
    expect(readSensorPacket(6, new Uint8Array(51))).toEqual({});
    expect(readSensorPacket(200, new Uint8Array(2))).toEqual({});
    expect(readSensorPacket(3, new Uint8Array(0))).toEqual({});
  });
});

describe("room and trail", () => {
  it("reads poses, walls and obstacles, and leaves out what is none", () => {
    expect(poseOf({ x: 1, y: 2, heading: 3, velocity: 0 })).toEqual({ x: 1, y: 2, theta: 3 });
    expect(poseOf({ x: 1, y: NaN, heading: 0 })).toBeNull();
    expect(poseOf(null)).toBeNull();
    const wall = { x1: 0, y1: 1, x2: 2, y2: 3 };
    expect(wallsOf([{ ...wall, height: 0.5 }, { x1: "?" }, null])).toEqual([wall]);
    expect(wallsOf(null)).toEqual([]);
    const obstacle = { x: 0, y: 1, radius: 0.2 };
    expect(obstaclesOf([{ ...obstacle, height: 0.3 }, { x: 1 }, null])).toEqual([obstacle]);
    expect(obstaclesOf("?")).toEqual([]);
  });
  it("joins walls that come back to their start", () => {
    const square = [
      { x1: 0, y1: 0, x2: 1, y2: 0 },
      { x1: 1, y1: 0, x2: 1, y2: 1 },
      { x1: 1, y1: 1, x2: 0, y2: 0 },
    ];
    const free = { x1: 5, y1: 5, x2: 6, y2: 6 };
    const { loops, open } = loopsOf([free, ...square, free]);
    expect(loops).toEqual([
      [
        { x: 0, y: 0 },
        { x: 1, y: 0 },
        { x: 1, y: 1 },
      ],
    ]);
    expect(open).toEqual([free, free]);
  });
  it("draws a new stroke after a jump and none for standing still", () => {
    const trail = new Trail();
    trail.add({ x: 0, y: 0 });
    trail.add({ x: 0.001, y: 0 });
    trail.add({ x: 0.1, y: 0 });
    trail.add({ x: 3, y: 0 });
    expect(trail.strokes.map((stroke) => stroke.length)).toEqual([2, 1]);
  });
  it("forgets the oldest of a very long trail", () => {
    const trail = new Trail();
    for (let i = 0; i < 30_000; i++) trail.add({ x: i * 0.02, y: 0 });
    expect(trail.count).toBeLessThanOrEqual(12_000);
    expect(trail.strokes[0]?.at(-1)?.x).toBeCloseTo(29_999 * 0.02);
  });
});

describe("series", () => {
  it("keeps its window and its limit", () => {
    const series = new Series(1000, 5);
    for (let t = 0; t <= 3000; t += 400) series.push(t, t);
    expect(series.samples[0]?.t).toBeGreaterThanOrEqual(1600);
    for (let t = 3001; t < 3020; t++) series.push(t, t);
    expect(series.samples).toHaveLength(5);
    series.push(4000, NaN);
    expect(series.newest?.t).toBe(3019);
  });
});

describe("what the robot tells", () => {
  beforeEach(() => void vi.useFakeTimers());
  afterEach(() => void vi.useRealTimers());

  it("is asked for again where that failed, or the device closed it, and that is told of meanwhile", async () => {
    const poses = [1, 2].map((x) => ({ x, y: 0, heading: 0 }));
    let isThere = false;
    let isClosed = true;
    const stop = new AbortController();
    const present = <T>(value: T): Promise<T> => (isThere ? Promise.resolve(value) : Promise.reject(new Error("away")));
    const model = new RobotModel();
    const remote = {
      has: (name: string, kind: string) =>
        `${kind} ${name}` === "wire state" || `${kind} ${name}` === "property radius",
      get: () => present(0.2),
      wire: async function* () {
        yield await present(null).then(() => poses.shift());
        if (!isClosed) await new Promise((resolve) => stop.signal.addEventListener("abort", resolve));
      },
    };
    model.attach(remote as never, stop.signal);
    await vi.advanceTimersByTimeAsync(10);
    expect(model.trouble.value).toBe("wire state: away");
    expect(model.heardAt("pose")).toBeNull();

    isThere = true;
    await vi.advanceTimersByTimeAsync(1_000);
    expect([model.radiusM, model.pose.x, model.trouble.value]).toEqual([0.2, 1, "wire state: the device closed it"]);
    isClosed = false;
    await vi.advanceTimersByTimeAsync(1_000);
    expect([model.pose.x, model.trouble.value]).toEqual([2, null]);
    stop.abort();
    await vi.advanceTimersByTimeAsync(10_000);
    expect(model.trouble.value).toBeNull();
  });
});

describe("the song", () => {
  it("is pairs of note and length, and rises with the way", () => {
    expect(Array.from(songAfter(0)).slice(0, 4)).toEqual([60, 16, 64, 16]);
    expect(songAfter(100)[0]).toBe(61);
    expect(songAfter(1200)[0]).toBe(60);
    expect(songAfter(-100)[0]).toBe(71);
  });
  it("is named as musicians do", () => {
    expect(nameNotes(Uint8Array.of(60, 16, 61, 8, 71, 1))).toBe("C4 C♯4 B4");
  });
});
