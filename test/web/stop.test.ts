// Stopping: past what waits, behind what it may have overtaken, and never said to have arrived where nothing was sent.
import { clear, find, press, show } from "./shown";
import { ErrorCode, RobotRaconteurError } from "../../wasm-client/dist/index.js";
import { StopButton } from "../../web/src/board/stop";
import { session } from "../../web/src/gateway/session";
import { onStop, tellStop, watchStop } from "../../web/src/robot/control";
import { OwnLocks } from "../../web/src/robot/own_locks";
import { remoteOf } from "../../web/src/robot/remote";
import type { Remote } from "../../web/src/robot/remote";
import { ROBOT_STOP, stopDevice } from "../../web/src/robot/stop";
import { UnderWay } from "../../web/src/robot/under_way";
import { HeldJog } from "../../web/src/panels/held_jog";

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

function makeDevice() {
  const underWay = new UnderWay();
  const urgent = vi.fn(() => Promise.resolve<unknown>(undefined));
  const setNow = vi.fn(() => Promise.resolve());
  const lease = () => Promise.reject(new Error("none"));
  return { underWay, urgent, setNow, lease, locks: new OwnLocks(), controls: new Map(), path: "Create" };
}

describe("a stop", () => {
  it("is sent once where nothing else is under way", async () => {
    const device = makeDevice();
    await stopDevice(device, { call: "halt", args: [] }, () => undefined);
    await vi.advanceTimersByTimeAsync(60_000);
    expect(device.urgent).toHaveBeenCalledOnce();
  });

  it("is sent again behind commands that it may have overtaken, until they have ended", async () => {
    const device = makeDevice();
    let end: () => void = () => undefined;
    void device.underWay.follow(new Promise<void>((resolve) => (end = resolve)));
    await stopDevice(device, { call: "halt", args: [] }, () => undefined);
    await vi.advanceTimersByTimeAsync(0);
    expect(device.urgent).toHaveBeenCalledTimes(2); // the second when the first is answered
    await vi.advanceTimersByTimeAsync(60_000);
    expect(device.urgent).toHaveBeenCalledTimes(7); // and not for ever
    end();
    await vi.advanceTimersByTimeAsync(60_000);
    expect(device.urgent).toHaveBeenCalledTimes(8);
  });

  it("that hangs is sent again when the command before it has ended, and tells of what failed", async () => {
    const device = makeDevice();
    const failed = vi.fn();
    device.urgent.mockReturnValueOnce(new Promise(() => undefined)).mockRejectedValueOnce(new Error("refused"));
    let end: () => void = () => undefined;
    void device.underWay.follow(new Promise<void>((resolve) => (end = resolve)));
    void stopDevice(device, { call: "halt", args: [] }, failed);
    await vi.advanceTimersByTimeAsync(10_000);
    expect(device.urgent).toHaveBeenCalledOnce();
    end();
    await vi.advanceTimersByTimeAsync(0);
    expect(device.urgent).toHaveBeenCalledTimes(2);
    expect(failed).toHaveBeenCalledWith(new Error("refused"));
  });

  it("arrives where a lock that this page had lost keeps it out: the lock is given up first", async () => {
    const device = makeDevice();
    const error = Object.create(RobotRaconteurError.prototype) as RobotRaconteurError;
    device.urgent.mockRejectedValueOnce(Object.assign(error, { code: ErrorCode.ObjectLockedError, message: "lost" }));
    const unlock = vi.fn(() => Promise.resolve());
    device.locks.add("Create", unlock);
    await stopDevice(device, { call: "halt", args: [] }, () => undefined);
    expect(unlock).toHaveBeenCalledOnce();
    expect(device.urgent).toHaveBeenCalledTimes(2);
  });

  it("arrives by either of the ways that a standard robot has, and else fails with why", async () => {
    const device = makeDevice();
    device.urgent.mockRejectedValue(new Error("no halt"));
    await stopDevice(device, ROBOT_STOP, () => undefined);
    expect(device.setNow).toHaveBeenCalledWith("command_mode", 0, { timeout: 2_000 });
    device.setNow.mockRejectedValue(new Error("no mode"));
    await expect(stopDevice(device, ROBOT_STOP, () => undefined)).rejects.toThrow("no halt");
  });

  it("tells those who hold something, and ends what is done in several steps", () => {
    const heard = vi.fn();
    const forget = onStop(heard);
    const isStopped = watchStop();
    expect(isStopped()).toBe(false);
    tellStop();
    expect([isStopped(), watchStop()()]).toEqual([true, false]);
    expect(heard).toHaveBeenCalledOnce();
    forget();
  });
});

describe("a stop over a connection that has broken unnoticed", () => {
  beforeEach(() => void vi.useRealTimers());
  afterEach(() => {
    clear();
    vi.restoreAllMocks();
  });

  /** What is fetched, and what is said in the end. */
  async function pressStop(code: keyof typeof ErrorCode, safe: string[], released = 204) {
    const device = makeDevice();
    const error = Object.create(RobotRaconteurError.prototype) as RobotRaconteurError;
    device.urgent.mockRejectedValue(Object.assign(error, { code: ErrorCode[code], message: "of the connection" }));
    const fetched: string[] = [];
    vi.spyOn(session, "fetch").mockImplementation((path) => {
      fetched.push(path);
      const isRelease = path.endsWith("release");
      return Promise.resolve(isRelease ? new Response(null, { status: released }) : Response.json({ lease: "key" }));
    });
    const place = { device: "robot", service: "Create" };
    show(StopButton, { object: device as unknown as Remote, stop: { call: "halt", args: [] }, place, safe });
    await press("Stop");
    const words = find(".stop-words");
    await vi.waitFor(() => expect(words.dataset.stop).not.toBe("sent"));
    return [fetched.map((path) => /lease=(\w+)/.exec(path)?.[1]), words.dataset.stop, words.textContent];
  }

  it.each(["RequestTimeout", "ConnectionError"] as const)("is passed on by the gateway: %s", async (code) => {
    const passed = [["take", "release"], "passed", expect.stringContaining("passed on by the gateway")];
    expect(await pressStop(code, ["Create.Drive"])).toEqual(passed);
  });

  it("says whether the device has answered the gateway", async () => {
    const words = async (status: number) => (await pressStop("ConnectionError", ["Create.Drive"], status))[2];
    expect(await words(204)).toContain("the device has answered");
    clear();
    expect(await words(202)).toContain("the device's answer is not known");
    clear();
    expect(await words(423)).toContain("NOT STOPPED");
  });

  it("has failed where the gateway knows of nothing that is safe, or the device has answered", async () => {
    const failed = [[], "failed", expect.stringContaining("NOT STOPPED: Error: of the connection")];
    expect(await pressStop("RequestTimeout", [])).toEqual(failed);
    clear();
    expect(await pressStop("InvalidOperation", ["Create.Drive"])).toEqual(failed);
  });
});

describe("a remote object", () => {
  const halt = vi.fn(() => Promise.resolve());
  const declare = (name: string, kind: string, type = "void") => ({ name, kind, type, parameters: [], modifiers: [] });
  const never = () => new Promise(() => undefined);
  const found: { $?: unknown } = {};
  const info = {
    type: "a.b.Robot",
    members: [
      declare("halt", "function"),
      declare("stop", "function", "double{generator}"),
      declare("abort", "property"),
    ],
    urgent: { halt, stop: halt },
    member: () => Object.assign(never, { get: () => Promise.resolve(found), set: never, poke: never }),
  };
  found.$ = info;
  const remote = () => remoteOf({ $: info } as never);

  it("calls at once what is a function, and says so of what is none", async () => {
    await remote().urgent("halt", []);
    expect(halt).toHaveBeenCalledOnce();
    for (const name of ["abort", "stop", "estop", "__proto__"])
      await expect(remote().urgent(name, []), name).rejects.toThrow(`no function "${name}"`);
    expect(halt).toHaveBeenCalledOnce();
  });

  it("knows its commands that are under way, and those of its children", async () => {
    const root = remote();
    expect(root.underWay.settled()).toBeNull();
    const child = await root.child("abort");
    void child.set("abort", 1);
    expect(root.underWay.settled()).not.toBeNull();
    expect(await root.child("abort")).toBe(child); // with what panels know of it: leases, locks
    await expect(root.call("unknown", [])).rejects.toThrow('no member "unknown"');
  });
});

describe("a jog", () => {
  function setup() {
    const answers: (() => void)[] = [];
    const means = {
      jog: vi.fn((_: () => boolean) => new Promise<void>((resolve) => answers.push(resolve))),
      mayGoOn: vi.fn(() => true),
      stop: vi.fn(() => Promise.resolve()),
      fail: vi.fn(),
      done: vi.fn(),
      changed: vi.fn(),
    };
    return { means, hold: new HeldJog(means), answers };
  }

  it("goes on while it is held, one command at a time", async () => {
    const { means, hold, answers } = setup();
    hold.begin();
    hold.begin();
    await vi.advanceTimersByTimeAsync(300);
    expect(means.jog).toHaveBeenCalledOnce();
    answers[0]?.();
    await vi.advanceTimersByTimeAsync(100);
    expect(means.jog).toHaveBeenCalledTimes(2);
    hold.end();
  });

  it("stops in the moment that it ends, and once more behind a command that hangs", async () => {
    const { means, hold, answers } = setup();
    hold.begin();
    const isHeld = means.jog.mock.calls[0]?.[0];
    hold.end();
    expect(means.stop).toHaveBeenCalledOnce();
    expect(isHeld?.()).toBe(false);
    await vi.advanceTimersByTimeAsync(1_000);
    expect(means.jog).toHaveBeenCalledOnce();
    answers[0]?.();
    await vi.advanceTimersByTimeAsync(0);
    expect(means.stop).toHaveBeenCalledTimes(2);
  });

  it("ends where the right that it has taken at its beginning is gone", async () => {
    const { means, hold, answers } = setup();
    means.mayGoOn.mockReturnValue(false);
    hold.begin();
    answers[0]?.();
    await vi.advanceTimersByTimeAsync(1_000);
    expect(means.jog).toHaveBeenCalledOnce();
    expect(means.changed.mock.calls).toEqual([[true], [false]]);
    expect(means.stop).toHaveBeenCalled();
    hold.begin();
    expect(means.jog).toHaveBeenCalledTimes(2);
    hold.end();
  });

  it("that failed is not held any more", async () => {
    const { means, hold } = setup();
    means.jog.mockRejectedValueOnce(new Error("refused"));
    hold.begin();
    await vi.advanceTimersByTimeAsync(1_000);
    expect(means.jog).toHaveBeenCalledOnce();
    expect(means.changed.mock.calls).toEqual([[true], [false]]);
    expect(means.fail).toHaveBeenCalledWith(new Error("refused"));
  });
});
