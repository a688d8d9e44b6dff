// Driving: one moving command in flight, and a stop at once, past what waits.
import { ErrorCode, RobotRaconteurError } from "../../wasm-client/dist/index.js";
import { Driver } from "../../web/src/robot/driver";
import { sameCommand, STOP, STRAIGHT, TURN_RADIUS } from "../../web/src/robot/steering";
import type { DriveCommand } from "../../web/src/robot/steering";

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

  interface Right {
    mayCommand: boolean;
    begin: () => Promise<void>;
  }

  function connected(right?: Right): { calls: Call[]; driver: Driver<DriveCommand> } {
    const { calls, send } = connection();
    const driver = makeDriver();
    driver.setConnection(right ? { send, right } : { send });
    return { calls, driver };
  }

  beforeEach(() => void vi.useFakeTimers());
  afterEach(() => void vi.useRealTimers());

  it("has one moving command in flight, and the newest wish replaces those that wait", async () => {
    const { calls, driver } = connected();
    driver.want(GO);
    driver.want(BACK);
    driver.want(TURN);
    expect(calls.map((c) => c.command)).toEqual([GO]);
    await calls[0]?.answer();
    expect(calls.map((c) => c.command)).toEqual([GO, TURN]);
  });
  it("asks for the right to move again where a stop that has just been answered took it away", async () => {
    const right = rightToMove();
    const { calls, driver } = connected(right);
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
    const right = rightToMove();
    const { calls, driver } = connected(right);
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
    const right = rightToMove();
    const { calls, driver } = connected(right);
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
      let give: () => void = () => undefined;
      const right = { mayCommand: true, begin: () => new Promise<void>((resolve) => (give = resolve)) };
      const { calls, driver } = connected(right);
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
    const { calls, driver } = connected();
    driver.want(GO);
    driver.want(TURN);
    vi.advanceTimersByTime(1000);
    expect(calls.map((c) => c.command)).toEqual([GO]);
    driver.want(STOP);
    expect(calls.map((c) => c.command)).toEqual([GO, STOP]);
  });
  it("sends nothing more to a robot at rest", async () => {
    const { calls, driver } = connected();
    driver.want(GO);
    driver.want(STOP);
    await calls[0]?.answer();
    await calls[1]?.answer();
    expect(driver.isMoving).toBe(false);
    vi.advanceTimersByTime(5000);
    expect(calls).toHaveLength(2);
  });
  it("drives on only when the stop before is answered", async () => {
    const { calls, driver } = connected();
    driver.want(GO);
    driver.want(STOP);
    driver.want(TURN);
    await calls[0]?.answer();
    expect(calls.map((c) => c.command)).toEqual([GO, STOP]);
    await calls[1]?.answer();
    expect(calls.map((c) => c.command)).toEqual([GO, STOP, TURN]);
  });
  it("stops once more where a moving command is answered after the stop that followed it", async () => {
    const { calls, driver } = connected();
    driver.want(GO);
    driver.want(STOP);
    await calls[1]?.answer();
    expect(driver.isMoving).toBe(true);
    await calls[0]?.answer();
    vi.advanceTimersByTime(450);
    expect(calls.map((c) => c.command)).toEqual([GO, STOP, STOP]);
  });
  it("stops a robot that others move when somebody asks for it, until the robot answers", async () => {
    const { calls, driver } = connected();
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
    const { calls, driver } = connected();
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
    const { calls, driver } = connected();
    driver.want(GO);
    await calls[0]?.answer();
    vi.advanceTimersByTime(450);
    expect(calls.map((c) => c.command)).toEqual([GO, GO]);
  });
  it("stops a robot that was moving when its connection broke, as soon as there is one again", async () => {
    const { calls, driver } = connected();
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
    const { calls, driver } = connected();
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
