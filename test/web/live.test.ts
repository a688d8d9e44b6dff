// What comes from a device, and whether it still answers.
import { ErrorCode, RobotRaconteurError } from "../../wasm-client/dist/index.js";
import { follow } from "../../web/src/gateway/link_to";
import { Feed } from "../../web/src/live/feed";
import { Pulse } from "../../web/src/live/pulse";

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

const failed = (code: keyof typeof ErrorCode) =>
  Object.assign(Object.create(RobotRaconteurError.prototype) as RobotRaconteurError, { code: ErrorCode[code] });

describe("a pulse", () => {
  const settle = () => vi.advanceTimersByTimeAsync(0);

  it("counts from the first question without an answer, however often it is asked anew", async () => {
    const ask = vi.fn((_: number) => Promise.reject<boolean>(failed("RequestTimeout")));
    const pulse = new Pulse(ask);
    expect(pulse.look(0, 0, false)).toBe(0);
    await settle();
    expect(pulse.look(10_000, 0, false)).toBe(10_000);
    await settle();
    expect(pulse.look(20_000, 0, false)).toBe(20_000);
    expect(ask).toHaveBeenCalledTimes(3);
    await settle();
    ask.mockRejectedValueOnce(failed("ObjectLockedError")); // a refusal is an answer
    pulse.look(20_400, 0, false);
    await settle();
    expect(pulse.look(20_500, 0, false)).toBe(0);
  });

  it("that is answered is told of, whatever no longer comes, unless a gateway may have answered", async () => {
    const pulse = new Pulse(() => Promise.resolve(true));
    pulse.look(0, 0, false);
    await settle();
    expect([pulse.look(100, 900, false), pulse.look(100, 900, true)]).toEqual([0, 900]);
    const nothing = new Pulse(() => Promise.resolve(false)); // has nothing to ask for
    nothing.look(0, 0, false);
    await settle();
    expect(nothing.look(100, 900, false)).toBe(900);
  });

  it("is asked for every 400 ms", async () => {
    const ask = vi.fn(() => Promise.resolve(true));
    const pulse = new Pulse(ask);
    for (let now = 0; now <= 1_000; now += 100) {
      pulse.look(now, 0, false);
      await settle();
    }
    expect(ask).toHaveBeenCalledTimes(3);
  });
});

describe("a feed", () => {
  const feedOf = (wire: (name: string, signal: AbortSignal) => AsyncGenerator<unknown, void>) =>
    new Feed({ wire } as never, "wire", "pose");

  it("that failed or was closed is tried again until something comes", async () => {
    let tries = 0;
    const feed = feedOf(async function* () {
      tries += 1;
      if (tries === 1) throw new Error("not now");
      yield tries;
      if (tries > 2) await new Promise(() => undefined);
    });
    feed.start();
    await vi.advanceTimersByTimeAsync(0);
    expect(feed.failure).toBe("not now");
    await vi.advanceTimersByTimeAsync(1_000);
    expect([feed.newest, feed.failure]).toEqual([2, "the device closed it"]);
    await vi.advanceTimersByTimeAsync(2_000);
    expect([feed.newest, feed.failure]).toEqual([3, null]);
    feed.stop();
  });

  it("that nobody looks at is tried no more", async () => {
    const wire = vi.fn(async function* () {
      yield* [];
    });
    const feed = feedOf(wire);
    feed.start();
    await vi.advanceTimersByTimeAsync(100);
    feed.stop();
    await vi.advanceTimersByTimeAsync(60_000);
    expect(wire).toHaveBeenCalledOnce();
  });
});

it("a connection hears that its device is away where it is shared, and that it is back", () => {
  const link = { setAway: vi.fn(), retryNow: vi.fn() };
  const hear = follow(link, "arm");
  const said = (state: string, mode = "shared") =>
    hear({ kind: "known", devices: [{ name: "arm", state, mode, lastError: null }] } as never);
  said("offline", "relay"); // it may have no ear for the gateway while this page has its only connection
  expect(link.setAway).not.toHaveBeenCalled();
  said("online");
  link.retryNow.mockClear();
  said("offline");
  expect(link.setAway).toHaveBeenLastCalledWith("offline");
  said("online");
  expect(link.setAway).toHaveBeenLastCalledWith(null);
  expect(link.retryNow).toHaveBeenCalledOnce();
});
