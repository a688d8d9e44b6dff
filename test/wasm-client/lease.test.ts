// Leases at a service that knows none, and calls that are sent past what waits. With a gateway: test/e2e/tests/lease.spec.ts.
import { readdirSync, readFileSync } from "node:fs";
import { Core, Info } from "../../wasm-client/dist/internal.js";
import { ErrorCode, lease, RobotRaconteurError } from "../../wasm-client/dist/node.js";
import { failure, settle, TestService } from "./service.js";
import type { NamedObject } from "./service.js";

const definition = `service test.lease
stdver 0.10
object Root
  property double speed
  wire double velocity
  function double drive(double speed)
  function string drive_by(string note)
  function string who()
  function int32{generator} count(int32 last)
end`;

let service: TestService;
let robot: NamedObject;
beforeEach(async () => {
  service = await TestService.start({ definitions: [definition], root: "test.lease.Root" });
  robot = await service.connect();
});
afterEach(async () => {
  vi.unstubAllGlobals();
  await robot.$.close();
});

it("says where there is no gateway that gives any", async () => {
  const error = await failure(lease(robot, { deadman: 300 }));
  expect([error.name, error.message]).toEqual([
    "RobotRaconteur.NotImplementedError",
    "there is no gateway that gives leases: the device is used without one",
  ]);
  expect(await robot["drive"]!(2)).toBe(2);
});

it("has bounds for the dead-man's time", async () => {
  for (const deadman of [49, 60_001, Number.NaN, -1])
    expect((await failure(lease(robot, { deadman }))).message).toBe(`deadman ${deadman}: expected 50 to 60000 ms`);
});

it("is not for a page that nobody looks at", async () => {
  vi.stubGlobal("document", { visibilityState: "hidden" });
  expect((await failure(lease(robot))).message).toBe("this page is hidden: it can hold no lease");
});

it("calls functions urgently, with arguments and options as otherwise", async () => {
  expect(Object.keys(robot.$.urgent)).toEqual(expect.arrayContaining(["drive", "drive_by", "who", "count"]));
  expect(await robot.$.urgent["drive"]!(3, { timeout: 1000 })).toBe(3);
  expect((await failure(Promise.resolve(robot.$.urgent["drive"]!(1, 2, 3)))).name).toBe(
    "RobotRaconteur.InvalidArgument",
  );
});

it("writes properties urgently", async () => {
  await robot.$.urgent["speed"]!(7, { timeout: 1000 });
  expect(await robot["speed"]!.get()).toBe(7);
});

/** A gateway of the object's session, whose renewals are answered as `renew` says. */
function gateway(renew: () => Promise<unknown>): () => void {
  const session = Info.sessionOf(robot);
  const request = session.request.bind(session);
  const spy = vi.spyOn(session, "request").mockImplementation((ask, options, done) => {
    let command = -1;
    const core = { lease: (_path: string, given: number) => ((command = given), 1) };
    try {
      ask(core as never);
    } catch {
      return request(ask, options, done); // of something else
    }
    return (command === 2 ? renew() : Promise.resolve(null)) as ReturnType<typeof request>;
  });
  return () => spy.mockRestore();
}

const late = () =>
  Promise.reject(new RobotRaconteurError({ code: ErrorCode.RequestTimeout, name: "late", message: "late" }));

describe("a lease", () => {
  let stop: () => void = () => undefined;
  let renew: () => Promise<unknown> = () => Promise.resolve(null);
  beforeEach(() => {
    vi.useFakeTimers();
    renew = () => Promise.resolve(null);
    stop = gateway(() => renew());
  });
  afterEach(() => {
    stop();
    vi.useRealTimers();
  });

  it("is doubtful once no renewal was answered for the dead-man's time, and held again with an answer", async () => {
    const held = await lease(robot, { deadman: 300 });
    const seen: unknown[] = [];
    held.onState((state, reason) => seen.push([state, reason?.message]));
    await vi.advanceTimersByTimeAsync(1000);
    expect([held.state, held.isHeld, held.reason, seen]).toEqual(["held", true, undefined, []]);
    const lost = vi.fn();
    held.onLost(lost);
    renew = () => new Promise(() => undefined); // the network is away
    await vi.advanceTimersByTimeAsync(200); // the last answer came to what was asked 100 ms ago, at most
    expect(held.isHeld).toBe(true);
    await vi.advanceTimersByTimeAsync(100);
    const why = "no renewal of the lease was answered for 300 ms: the gateway may have ended it";
    expect([held.state, held.isHeld, held.reason?.message]).toEqual(["doubtful", false, why]);
    expect(seen).toEqual([["doubtful", why]]);
    expect(lost).not.toHaveBeenCalled();
    await held.release();
    expect([held.state, held.reason]).toEqual(["released", undefined]);
  });

  it("is held again, or lost, with the gateway's next answer", async () => {
    const held = await lease(robot, { deadman: 300 });
    const seen: string[] = [];
    held.onState((state) => seen.push(state));
    renew = late;
    await vi.advanceTimersByTimeAsync(400);
    renew = () => Promise.resolve(null);
    await vi.advanceTimersByTimeAsync(100);
    expect([held.isHeld, held.reason]).toEqual([true, undefined]);
    renew = late;
    await vi.advanceTimersByTimeAsync(400);
    const ended = new RobotRaconteurError({ code: ErrorCode.InvalidOperation, name: "ended", message: "has ended" });
    renew = () => Promise.reject(ended);
    await vi.advanceTimersByTimeAsync(100);
    expect(seen).toEqual(["doubtful", "held", "doubtful", "lost"]);
    expect([held.state, held.reason, await held.ended]).toEqual(["lost", ended, ended]);
  });

  it("is doubtful by the clock, before any timer of a page that wakes up has run", async () => {
    const held = await lease(robot, { deadman: 300 });
    vi.setSystemTime(Date.now() + 1000);
    const now = performance.now();
    const clock = vi.spyOn(performance, "now").mockReturnValue(now + 300);
    expect(held.isHeld).toBe(false);
    clock.mockRestore();
    await held.release();
  });

  it("limits calls, and writes of properties and wires, but not reads", async () => {
    const session = Info.sessionOf(robot);
    const held = await lease(robot, { deadman: 60_000, callTimeout: 500 });
    const timeouts: unknown[] = [];
    vi.spyOn(session, "request").mockImplementation((_ask, options) => {
      timeouts.push(options?.timeout);
      return Promise.resolve(null);
    });
    await robot["drive"]!(1);
    await robot["speed"]!.set(1);
    await robot["velocity"]!.poke(1);
    await robot["speed"]!.set(1, { timeout: 700 });
    await robot["speed"]!.set(1, { timeout: undefined });
    await robot["speed"]!.get();
    await robot["velocity"]!.peek();
    expect(timeouts).toEqual([500, 500, 500, 700, 500, undefined, undefined]);
    await held.release();
    timeouts.length = 0;
    await robot["speed"]!.set(1);
    expect(timeouts).toEqual([undefined]);
  });
});

describe("a lease that is given up while it is asked for", () => {
  const [acquire, release] = [0, 3];
  let commands: () => unknown[];
  beforeEach(() => {
    const asked = vi.spyOn(Core.prototype, "lease");
    commands = () => asked.mock.calls.map(([, command]) => command);
    service.isMute = true;
  });
  afterEach(() => {
    vi.restoreAllMocks();
    service.isMute = false;
  });

  /** Asks for it and gives it up, after `meanwhile`. */
  const giveUp = async (meanwhile: () => void = () => undefined) => {
    const abort = new AbortController();
    const asking = failure(lease(robot, { signal: abort.signal }));
    await settle();
    meanwhile();
    await settle();
    abort.abort(new Error("enough"));
    expect((await asking).message).toBe("enough");
    await settle();
  };

  it("is given back: the gateway may grant it yet", async () => {
    await giveUp();
    expect(commands()).toEqual([acquire, release]);
    expect((await failure(lease(robot, { timeout: 5 }))).code).toBe(ErrorCode.RequestTimeout);
    await settle();
    expect(commands()).toEqual([acquire, release, acquire, release]);
  });

  it("stays where it is held, or asked for again", async () => {
    const stop = gateway(() => Promise.resolve(null));
    const held = await lease(robot, { deadman: 60_000 });
    stop();
    await giveUp();
    expect(commands()).toEqual([acquire]);
    void held.release().catch(() => undefined);
    await settle();
    let again: Promise<unknown> | undefined;
    const second = new AbortController();
    await giveUp(() => void (again = failure(lease(robot, { signal: second.signal }))));
    expect(commands()).toEqual([acquire, release, acquire, acquire]);
    second.abort();
    await again;
    await settle();
    expect(commands().slice(4)).toEqual([release]);
  });

  it("stays refused where it was lost, until it is released", async () => {
    const stop = gateway(() => Promise.reject(new Error("taken over")));
    const held = await lease(robot, { deadman: 150 });
    await held.ended;
    expect(held.state).toBe("lost");
    stop();
    const before = commands().length;
    await giveUp();
    expect(commands().slice(before)).toEqual([acquire]);
    void held.release().catch(() => undefined);
    await settle();
    await giveUp();
    expect(commands().slice(before)).toEqual([acquire, release, acquire, release]);
  });

  it("is not given back where the gateway was not asked, or refuses", async () => {
    const signal = AbortSignal.abort(new Error("enough"));
    expect((await failure(lease(robot, { signal }))).message).toBe("enough");
    service.isMute = false;
    expect((await failure(lease(robot))).code).toBe(ErrorCode.NotImplementedError);
    await settle();
    expect(commands()).toEqual([acquire]);
  });
});

it("sends urgent calls and writes past all but what the WebSocket has", async () => {
  let buffered = 0;
  const service = await TestService.start({ definitions: [definition], root: "test.lease.Root" });
  const open: typeof service.transport = async (url, listener) => {
    const inner = await service.transport(url, listener);
    return {
      ...inner,
      send: (bytes) => ((buffered += bytes.length), inner.send(bytes)),
      get buffered() {
        return buffered; // nothing of it is on its way yet
      },
    };
  };
  const slow = await service.connect({ transport: open });
  const sizeBefore = (buffered = 0);
  const old = [...Array(10)].map(() => slow["drive_by"]!("x".repeat(50_000)));
  await settle();
  expect(buffered).toBeGreaterThan(sizeBefore);
  expect(buffered).toBeLessThan(128 * 1024);
  const order: string[] = [];
  void slow.$.urgent["drive"]!(0).then(() => order.push("urgent"));
  void slow.$.urgent["speed"]!(0).then(() => order.push("written"));
  for (const call of old) void call.then(() => order.push("older"));
  await settle();
  buffered = 0;
  const drained = setInterval(() => (buffered = 0), 1);
  await vi.waitUntil(() => order.length === 12);
  clearInterval(drained);
  expect(order.indexOf("urgent")).toBeLessThanOrEqual(3);
  expect(order.indexOf("written")).toBeLessThanOrEqual(4);
  await slow.$.close();
});

it("loads when it is used, and not before", () => {
  const dist = new URL("../../wasm-client/dist/", import.meta.url);
  for (const file of readdirSync(dist).filter((name) => name.endsWith(".js")))
    expect(readFileSync(new URL(file, dist), "utf8"), file).not.toMatch(/from "\.\/lease/);
});
