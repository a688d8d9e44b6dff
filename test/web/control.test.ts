import { Control, stopNow } from "../../web/src/robot/control";
import { ErrorCode, RobotRaconteurError } from "../../wasm-client/dist/index.js";
import { Driver } from "../../web/src/robot/driver";
import { OwnLocks } from "../../web/src/robot/own_locks";

const failed = (code: keyof typeof ErrorCode, message: string) =>
  Object.assign(Object.create(RobotRaconteurError.prototype) as RobotRaconteurError, {
    code: ErrorCode[code],
    message,
  });

/** A gateway in the hands of the test. */
function setup(answer: () => Promise<unknown> = () => Promise.resolve()) {
  const losers: ((reason: Error) => void)[] = [];
  const watchers: ((state: string, reason?: Error) => void)[] = [];
  const held = {
    onState: (changed: (state: string, reason?: Error) => void) => watchers.push(changed),
    onLost: (lost: (reason: Error) => void) => losers.push(lost),
    release: vi.fn(() => Promise.resolve()),
  };
  const lease = vi.fn(async () => (await answer(), held));
  const locks = new OwnLocks();
  const controls = new Map<string, Control>();
  const object = { lease, locks, path: "Create.arm", controls } as never;
  const control = new Control(object);
  controls.set("Create.arm", control);
  return {
    control,
    object,
    lease,
    locks,
    held,
    lose: (reason: Error) => losers.at(-1)?.(reason),
    tell: (state: string, reason?: Error) => watchers.at(-1)?.(state, reason),
  };
}

afterEach(() => void vi.useRealTimers());

describe("control", () => {
  it("is asked for once, however many commands wait for it", async () => {
    const { control, lease } = setup();
    await Promise.all([control.begin(), control.begin()]);
    await control.begin();
    expect(lease).toHaveBeenCalledOnce();
    expect(control.mayCommand).toBe(true);
  });
  it("that is lost begins by hand alone", async () => {
    const { control, lose } = setup();
    await control.begin();
    lose(failed("InvalidOperation", "the lease of Create has ended: it was taken over by vera"));
    expect(control.state.value).toMatchObject({ kind: "lost", byOthers: true });
    await expect(control.begin()).rejects.toThrow("taken over by vera");
    await control.take(true);
    expect(control.mayCommand).toBe(true);
  });
  it("that the gateway does not confirm commands nothing until it does", async () => {
    const { control, lease, tell } = setup();
    await control.begin();
    const before = control.state.value;
    tell("doubtful", failed("RequestTimeout", "no renewal was answered"));
    expect(control.mayCommand).toBe(false);
    await expect(control.begin()).rejects.toThrow("no renewal was answered");
    tell("held");
    expect(control.state.value).toEqual(before);
    expect(lease).toHaveBeenCalledOnce();
  });
  it("needs no lease where nobody gives any, and says what else is wrong", async () => {
    const free = setup(() => Promise.reject(failed("NotImplementedError", "none")));
    await free.control.begin();
    expect(free.control.state.value).toEqual({ kind: "free" });
    const refused = setup(() => Promise.reject(failed("AuthenticationError", "no right")));
    await expect(refused.control.begin()).rejects.toThrow("no right");
    expect(refused.control.state.value).toMatchObject({ kind: "lost", byOthers: false });
  });
  it("is given back when the last panel is gone", async () => {
    const { control, held } = setup();
    const uses = [control.use(), control.use()];
    await control.begin();
    uses[0]?.();
    expect(held.release).not.toHaveBeenCalled();
    uses[1]?.();
    expect(held.release).toHaveBeenCalledOnce();
  });
  it("that went with the device is given back, said to be lost, and begins by hand alone over the next connection", async () => {
    const { control, held, object, tell } = setup();
    await control.begin();
    control.end("the device is away");
    expect(control.state.value).toMatchObject({ kind: "lost", byOthers: false });
    expect(held.release).toHaveBeenCalledOnce();
    tell("held"); // an answer that comes late
    expect(control.mayCommand).toBe(false);
    const next = new Control(object, control);
    await expect(next.begin()).rejects.toThrow("the device is away");
    await next.take();
    expect(next.mayCommand).toBe(true);
    expect(new Control(object, next).state.value).toEqual({ kind: "idle" });
  });
  it("that is granted when nobody shows it any more, or the device has gone, is given back at once", async () => {
    for (const leave of [(control: Control) => control.use()(), (control: Control) => control.end("away")]) {
      let give: () => void = () => undefined;
      const { control, held } = setup(() => new Promise<void>((resolve) => (give = resolve)));
      const begun = control.begin();
      leave(control);
      give();
      await expect(begun).rejects.toThrow("nothing was sent");
      expect(held.release).toHaveBeenCalledOnce();
      expect(control.state.value).toEqual({ kind: "idle" });
    }
  });
  it("is taken over by a stop that somebody asked for, and not by one that follows a key", async () => {
    const { object, lease, held } = setup();
    const refused = () => Promise.reject(failed("ObjectLockedError", "held by vera"));
    await stopNow(object, false, refused);
    expect(lease).not.toHaveBeenCalled();
    await stopNow(object, true, refused);
    expect(lease).toHaveBeenCalledWith({ takeover: true, timeout: 2_000 });
    expect(held.release).toHaveBeenCalledOnce();
    await expect(stopNow(object, true, () => Promise.reject(new Error("away")))).rejects.toThrow("away");
  });
  it("that needed no lease over the connection before: a stop that somebody's lock keeps out has stopped nothing", async () => {
    const { control, object } = setup(() => Promise.reject(failed("NotImplementedError", "none")));
    await control.begin();
    const { controls } = object as { controls: Map<string, Control> };
    controls.set("Create.arm", new Control(object, control));
    const refused = () => stopNow(object, false, () => Promise.reject(failed("ObjectLockedError", "locked by vera")));
    await expect(refused()).rejects.toThrow("locked by vera");
    controls.set("Create.arm", new Control(setup().object, control)); // of a gateway that gives leases by now
    await expect(refused()).rejects.toThrow("locked by vera");
    await controls.get("Create.arm")?.begin();
    await refused(); // the gateway makes safe what was commanded since
  });
  it("that needs no lease: a stop that somebody's lock keeps out has stopped nothing, and is sent again", async () => {
    vi.useFakeTimers();
    const { control, object } = setup(() => Promise.reject(failed("NotImplementedError", "none")));
    let isLocked = false;
    const sent: number[] = [];
    const send = async (command: number): Promise<void> => {
      const way = async (): Promise<void> => {
        sent.push(command);
        if (isLocked) throw failed("ObjectLockedError", "locked by vera");
      };
      await (command === 0 ? stopNow(object, false, way) : way());
    };
    const onError = vi.fn();
    const driver = new Driver<number>({ rest: 0, same: Object.is, onError });
    driver.setConnection({ send, right: control });
    driver.want(5);
    await vi.advanceTimersByTimeAsync(0);
    isLocked = true;
    await vi.advanceTimersByTimeAsync(1_300);
    expect(sent).toEqual([5, 5, 0, 0, 0]);
    expect(onError).toHaveBeenCalledTimes(4);
    expect(driver.isMoving).toBe(true);
    isLocked = false;
    await vi.advanceTimersByTimeAsync(400);
    expect(driver.isMoving).toBe(false);
    driver.dispose();
  });
  it.each(["PermissionDenied", "OutOfSystemResource", "RequestTimeout"] as const)(
    "is given back where a stop failed with %s, so that the gateway makes the device safe",
    async (code) => {
      const { control, object, held, tell } = setup();
      const fails = () => stopNow(object, false, () => Promise.reject(failed(code, "not now")));
      await expect(fails()).rejects.toThrow("not now");
      await control.begin();
      tell("doubtful", failed("RequestTimeout", "no renewal was answered")); // the dead-man acts
      await expect(fails()).rejects.toThrow("not now");
      expect(held.release).not.toHaveBeenCalled();
      tell("held");
      await expect(fails()).rejects.toThrow("not now");
      expect(held.release).toHaveBeenCalledOnce();
      expect(control.state.value).toMatchObject({ kind: "lost", byOthers: false });
      await expect(control.begin()).rejects.toThrow("not now"); // by hand alone
    },
  );
  it("is left alone by a stop that a lock of this page keeps out: that is given up, and the stop is sent again", async () => {
    const { object, lease, locks } = setup();
    const unlock = vi.fn(() => Promise.resolve());
    locks.add("Create", unlock);
    locks.add("Create.ar", () => Promise.reject(new Error("of another object")));
    const stop = vi.fn(() =>
      unlock.mock.calls.length > 0 ? Promise.resolve() : Promise.reject(failed("ObjectLockedError", "lost")),
    );
    await stopNow(object, false, stop);
    expect(stop).toHaveBeenCalledTimes(2);
    expect([...locks.state.value.keys()]).toEqual(["Create.ar"]);
    expect(lease).not.toHaveBeenCalled();
  });
  it("is taken by a stop where nobody has it and none may be taken over, and else left with whoever has it", async () => {
    const answers = [failed("PermissionDenied", "no takeover"), null];
    const { object, lease, held } = setup(() => {
      const answer = answers.shift();
      return answer ? Promise.reject(answer) : Promise.resolve();
    });
    const refused = () => Promise.reject(failed("ObjectLockedError", "it has ended"));
    await stopNow(object, true, refused);
    expect(lease.mock.calls).toEqual([[{ takeover: true, timeout: 2_000 }], [{ timeout: 2_000 }]]);
    expect(held.release).toHaveBeenCalledOnce();
    answers.splice(0, 1, failed("PermissionDenied", "no takeover"), failed("ObjectLockedError", "held by vera"));
    await expect(stopNow(object, true, refused)).rejects.toThrow("it has ended");
  });
  it("that comes after the key was let go moves nothing", async () => {
    let give: () => void = () => undefined;
    const { control } = setup(() => new Promise<void>((resolve) => (give = resolve)));
    const sent: number[] = [];
    const driver = new Driver<number>({ rest: 0, same: Object.is, onError: () => undefined });
    driver.setConnection({ send: async (command) => void sent.push(command), right: control });
    driver.want(5);
    driver.want(0);
    give();
    await vi.waitFor(() => expect(control.mayCommand).toBe(true));
    await Promise.resolve();
    expect(sent).toEqual([]);
    driver.want(5);
    expect(sent).toEqual([5]);
    driver.dispose();
  });
});
