import { ErrorCode, RobotRaconteurError } from "../../wasm-client/dist/index.js";
import { Driver } from "../../web/src/robot/driver";
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
  sameCommand,
  SPIN_LEFT,
  SPIN_RIGHT,
  STOP,
  STRAIGHT,
  TURN_RADIUS,
} from "../../web/src/robot/steering";
import type { Direction, DriveCommand } from "../../web/src/robot/steering";
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

describe("driver", () => {
  const GO: DriveCommand = { velocity: 200, radius: STRAIGHT };
  const BACK: DriveCommand = { velocity: -200, radius: STRAIGHT };
  const TURN: DriveCommand = { velocity: 200, radius: TURN_RADIUS };

  interface Call {
    command: DriveCommand;
    answer: () => Promise<void>;
    fail: (error: Error) => Promise<void>;
  }

  const makeDriver = (onError: (error: unknown) => void = () => undefined) =>
    new Driver<DriveCommand>({ rest: STOP, same: sameCommand, onError });

  /** It is there, and comes back whenever it is asked for. */
  const rightToMove = () => {
    const right = { mayCommand: true, begin: vi.fn(() => Promise.resolve(void (right.mayCommand = true))) };
    return right;
  };

  function connection(): { calls: Call[]; send: (command: DriveCommand) => Promise<void> } {
    const calls: Call[] = [];
    const settle = async (action: () => void): Promise<void> => {
      action();
      await Promise.resolve();
      await Promise.resolve();
    };
    const send = (command: DriveCommand): Promise<void> =>
      new Promise((resolve, reject) => {
        calls.push({ command, answer: () => settle(resolve), fail: (error) => settle(() => reject(error)) });
      });
    return { calls, send };
  }

  beforeEach(() => void vi.useFakeTimers());
  afterEach(() => void vi.useRealTimers());

  it("has one moving command in flight, and the newest wish replaces those that wait", async () => {
    const { calls, send } = connection();
    const driver = makeDriver();
    driver.setConnection({ send });
    driver.want(GO);
    driver.want(BACK);
    driver.want(TURN);
    expect(calls.map((c) => c.command)).toEqual([GO]);
    await calls[0]?.answer();
    expect(calls.map((c) => c.command)).toEqual([GO, TURN]);
  });
  it("asks for the right to move again where a stop that has just been answered took it away", async () => {
    const { calls, send } = connection();
    const driver = makeDriver();
    const right = rightToMove();
    driver.setConnection({ send, right });
    driver.want(GO);
    await calls[0]?.answer();
    driver.stop();
    right.mayCommand = false;
    driver.want(TURN);
    expect(right.begin).not.toHaveBeenCalled(); // the stop is not answered yet
    await calls[1]?.answer();
    expect(right.begin).toHaveBeenCalledTimes(1);
    await Promise.resolve();
    expect(calls.map((c) => c.command)).toEqual([GO, STOP, TURN]);
  });
  it("stops once the right to move was given back, and moves by a new wish alone", async () => {
    const { calls, send } = connection();
    const driver = makeDriver();
    const right = rightToMove();
    driver.setConnection({ send, right });
    driver.want(GO);
    await calls[0]?.answer();
    right.mayCommand = false;
    vi.advanceTimersByTime(500);
    expect(calls.map((c) => c.command)).toEqual([GO, STOP]);
    await calls[1]?.answer();
    vi.advanceTimersByTime(2_000);
    expect([calls.length, right.begin.mock.calls.length]).toEqual([2, 0]);
    driver.want(GO);
    await Promise.resolve();
    expect(calls.map((c) => c.command)).toEqual([GO, STOP, GO]);
  });
  it("drops a wish that waited for an answer while the right to move was given back", async () => {
    const { calls, send } = connection();
    const driver = makeDriver();
    const right = rightToMove();
    driver.setConnection({ send, right });
    driver.want(GO);
    driver.want(TURN);
    right.mayCommand = false;
    await calls[0]?.answer();
    expect(calls.map((c) => c.command)).toEqual([GO, STOP]);
    expect(right.begin).not.toHaveBeenCalled();
  });
  it.each(["answered", "lost"])(
    "sends no wish while the right to it is asked for, where a stop was %s",
    async (stop) => {
      const { calls, send } = connection();
      const driver = makeDriver();
      let give: () => void = () => undefined;
      const right = { mayCommand: true, begin: () => new Promise<void>((resolve) => (give = resolve)) };
      driver.setConnection({ send, right });
      driver.want(GO);
      await calls[0]?.answer();
      driver.stop();
      right.mayCommand = false;
      if (stop === "answered") {
        driver.want(TURN);
        await calls[1]?.answer();
      } else {
        await calls[1]?.fail(new Error("no answer"));
        driver.want(TURN);
      }
      vi.advanceTimersByTime(500);
      const stops = stop === "answered" ? [STOP] : [STOP, STOP];
      expect(calls.map((c) => c.command)).toEqual([GO, ...stops]);
      await calls[2]?.answer();
      right.mayCommand = true;
      give();
      await Promise.resolve();
      expect(calls.map((c) => c.command)).toEqual([GO, ...stops, TURN]);
    },
  );
  it("sends a stop at once, past a command that is never answered", () => {
    const { calls, send } = connection();
    const driver = makeDriver();
    driver.setConnection({ send });
    driver.want(GO);
    driver.want(TURN);
    vi.advanceTimersByTime(1000);
    expect(calls.map((c) => c.command)).toEqual([GO]);
    driver.want(STOP);
    expect(calls.map((c) => c.command)).toEqual([GO, STOP]);
  });
  it("sends nothing more to a robot at rest", async () => {
    const { calls, send } = connection();
    const driver = makeDriver();
    driver.setConnection({ send });
    driver.want(GO);
    driver.want(STOP);
    await calls[0]?.answer();
    await calls[1]?.answer();
    expect(driver.isMoving).toBe(false);
    vi.advanceTimersByTime(5000);
    expect(calls).toHaveLength(2);
  });
  it("drives on only when the stop before is answered", async () => {
    const { calls, send } = connection();
    const driver = makeDriver();
    driver.setConnection({ send });
    driver.want(GO);
    driver.want(STOP);
    driver.want(TURN);
    await calls[0]?.answer();
    expect(calls.map((c) => c.command)).toEqual([GO, STOP]);
    await calls[1]?.answer();
    expect(calls.map((c) => c.command)).toEqual([GO, STOP, TURN]);
  });
  it("stops once more where a moving command is answered after the stop that followed it", async () => {
    const { calls, send } = connection();
    const driver = makeDriver();
    driver.setConnection({ send });
    driver.want(GO);
    driver.want(STOP);
    await calls[1]?.answer();
    expect(driver.isMoving).toBe(true);
    await calls[0]?.answer();
    vi.advanceTimersByTime(450);
    expect(calls.map((c) => c.command)).toEqual([GO, STOP, STOP]);
  });
  it("stops a robot that others move when somebody asks for it, until the robot answers", async () => {
    const { calls, send } = connection();
    const driver = makeDriver();
    driver.setConnection({ send });
    driver.stop();
    expect(calls.map((c) => c.command)).toEqual([STOP]);
    await calls[0]?.fail(new Error("timeout"));
    vi.advanceTimersByTime(450);
    expect(calls.map((c) => c.command)).toEqual([STOP, STOP]);
    await calls[1]?.answer();
    vi.advanceTimersByTime(5000);
    expect(calls).toHaveLength(2);
  });
  const refused = () =>
    new RobotRaconteurError({
      code: ErrorCode.PermissionDenied,
      name: "RobotRaconteur.PermissionDenied",
      message: "no",
    });
  it("does not repeat a stop that is refused where it has moved nothing", async () => {
    const { calls, send } = connection();
    const told = vi.fn();
    const driver = makeDriver(told);
    driver.setConnection({ send });
    driver.stop();
    await calls[0]?.fail(refused());
    vi.advanceTimersByTime(5000);
    expect([calls.length, driver.isMoving, told.mock.calls.length]).toEqual([1, false, 1]);
    driver.want(GO);
    await calls[1]?.fail(refused());
    vi.advanceTimersByTime(5000);
    expect([calls.length, driver.isMoving]).toEqual([2, false]);
  });
  it("repeats a stop that is refused where it may have moved the robot", async () => {
    const { calls, send } = connection();
    const driver = makeDriver();
    driver.setConnection({ send });
    driver.want(GO);
    driver.stop();
    await calls[1]?.fail(refused());
    await calls[0]?.fail(new Error("timeout"));
    vi.advanceTimersByTime(450);
    expect(calls.map((c) => c.command)).toEqual([GO, STOP, STOP]);
    await calls[2]?.answer();
    vi.advanceTimersByTime(5000);
    expect([calls.length, driver.isMoving]).toEqual([3, false]);
  });
  it("says that a stop could not be sent without a connection", () => {
    const { calls, send } = connection();
    const driver = makeDriver();
    expect(driver.stop()).toBe(false);
    driver.setConnection({ send });
    expect([calls.length, driver.stop()]).toEqual([0, true]);
    driver.dispose();
    expect(driver.stop()).toBe(false);
  });
  it("repeats a held command, and not a stop", async () => {
    const { calls, send } = connection();
    const driver = makeDriver();
    driver.setConnection({ send });
    driver.want(GO);
    await calls[0]?.answer();
    vi.advanceTimersByTime(450);
    expect(calls.map((c) => c.command)).toEqual([GO, GO]);
  });
  it("stops a robot that was moving when its connection broke, as soon as there is one again", async () => {
    const { calls, send } = connection();
    const driver = makeDriver();
    driver.setConnection({ send });
    driver.want(GO);
    await calls[0]?.answer();
    driver.setConnection(null);
    driver.want(GO);
    expect(calls).toHaveLength(1);
    const again = connection();
    driver.setConnection(again);
    expect(again.calls.map((c) => c.command)).toEqual([STOP]);
  });
  it("leaves a robot alone that it never moved: somebody else may be driving", () => {
    const { calls, send } = connection();
    const driver = makeDriver();
    driver.setConnection({ send });
    driver.want(STOP);
    expect(calls).toHaveLength(0);
  });
  it("stops after a failed command, and tries a failed stop again", async () => {
    const { calls, send } = connection();
    const errors: unknown[] = [];
    const driver = makeDriver((error) => errors.push(error));
    driver.setConnection({ send });
    driver.want(GO);
    await calls[0]?.fail(new Error("timeout"));
    expect(calls.map((c) => c.command)).toEqual([GO, STOP]);
    await calls[1]?.fail(new Error("timeout"));
    expect(calls).toHaveLength(2);
    vi.advanceTimersByTime(450);
    expect(calls.map((c) => c.command)).toEqual([GO, STOP, STOP]);
    await calls[2]?.answer();
    vi.advanceTimersByTime(5000);
    expect(calls).toHaveLength(3);
    expect(errors).toHaveLength(2);
  });
  it("does not mind the answers of a connection that is gone", async () => {
    const { calls, send } = connection();
    const errors: unknown[] = [];
    const driver = makeDriver((error) => errors.push(error));
    driver.setConnection({ send });
    driver.want(GO);
    driver.setConnection(null);
    await calls[0]?.fail(new Error("connection lost"));
    expect(errors).toEqual([]);
    expect(driver.isMoving).toBe(true);
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
