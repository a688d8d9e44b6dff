// What comes from a device, and whether it still answers.
import { ErrorCode, RobotRaconteurError } from "../../wasm-client/dist/index.js";
import { follow } from "../../web/src/gateway/link_to";
import { DeviceList } from "../../web/src/gateway/devices";
import { definitionsOf } from "../../web/src/live/definitions";
import { Feed } from "../../web/src/live/feed";
import { pause } from "../../web/src/live/pause";
import { Pulse } from "../../web/src/live/pulse";
import { Shared } from "../../web/src/live/shared";

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

  it("takes what a gateway says that has no connection to the device for no answer", async () => {
    const pulse = new Pulse(() => Promise.reject(failed("ConnectionError")));
    pulse.look(0, 0, true);
    await settle();
    expect(pulse.look(1_000, 0, true)).toBe(1_000);
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

test("what is shared is made for the first, and ends with the last, however often one of them closes it", () => {
  const shared = new Shared<string, string>();
  const end = vi.fn();
  const make = vi.fn(() => ({ value: "made", end }));
  const [one, two] = [shared.open("a", make), shared.open("a", make)];
  expect([make.mock.calls.length, one.value, two.value, shared.values]).toEqual([1, "made", "made", ["made"]]);
  one.close();
  one.close();
  expect([end.mock.calls.length, shared.values]).toEqual([0, ["made"]]);
  two.close();
  expect([end.mock.calls.length, shared.values]).toEqual([1, []]);
  shared.open("a", make);
  expect(make).toHaveBeenCalledTimes(2);
});

describe("a pause", () => {
  it("ends with its time or with its signal, and leaves nothing at the signal", async () => {
    const stop = new AbortController();
    const added = vi.spyOn(stop.signal, "addEventListener");
    const removed = vi.spyOn(stop.signal, "removeEventListener");
    const ended = vi.fn();
    void pause(100, stop.signal).then(ended);
    await vi.advanceTimersByTimeAsync(99);
    expect(ended).not.toHaveBeenCalled();
    await vi.advanceTimersByTimeAsync(1);
    expect(ended).toHaveBeenCalledTimes(1);
    expect(removed.mock.calls.map(([name, heard]) => [name, heard])).toEqual(
      added.mock.calls.map(([name, heard]) => [name, heard]),
    );
    const early = pause(100_000, stop.signal);
    stop.abort();
    await early;
    await pause(100_000, stop.signal); // has ended already
    expect(vi.getTimerCount()).toBe(0);
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

  it("says of a value whether it came right after the one before", async () => {
    const feed = feedOf(async function* () {
      for (const pause of [100, 100, 100, 100, 2_000, 100]) {
        await new Promise((resolve) => setTimeout(resolve, pause));
        yield pause;
      }
    });
    const gaps: boolean[] = [];
    feed.heard.add((_value, _now, isAfterGap) => void gaps.push(isAfterGap));
    feed.start();
    await vi.advanceTimersByTimeAsync(2_600);
    feed.stop();
    expect(gaps).toEqual([true, false, false, false, true, false]);
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

it("a list of devices that is as before is told to connections, and not to pages", async () => {
  vi.stubGlobal("document", { baseURI: "https://host/", addEventListener: vi.fn(), removeEventListener: vi.fn() });
  let state = "online";
  let isAway = false;
  vi.stubGlobal("fetch", () =>
    isAway
      ? Promise.reject(new TypeError("failed"))
      : Promise.resolve(Response.json({ devices: [{ name: "arm", state }] })),
  );
  const list = new DeviceList();
  const [pages, connections] = [vi.fn(), vi.fn()];
  list.state.watch(pages);
  list.answers.watch(connections);
  list.start();
  const told = async () => {
    await vi.advanceTimersByTimeAsync(3_900);
    return [pages, connections].map((each) => each.mock.calls.length);
  };
  expect(await told()).toEqual([1, 2]);
  state = "offline";
  expect(await told()).toEqual([2, 4]);
  isAway = true;
  expect(await told()).toEqual([3, 6]);
  isAway = false;
  expect(await told()).toEqual([4, 8]);
  list.stop();
  expect(list.state.value.kind).toBe("loading");
  vi.unstubAllGlobals();
});

it("definitions are read every two seconds, however many look, and anew where there are more", () => {
  const texts = ["service a\n", "service b\n"];
  const read = vi.fn(() => [...texts]);
  const object = Object.defineProperty({}, "definitions", { get: read }) as never;
  const first = definitionsOf(object, 0);
  expect([definitionsOf(object, 10), definitionsOf(object, 1_999)]).toEqual([first, first]);
  expect(read).toHaveBeenCalledOnce();
  expect(definitionsOf(object, 2_000)).toBe(first);
  texts.push("service c\n");
  expect(definitionsOf(object, 2_010)).toBe(first);
  expect(definitionsOf(object, 4_000)).not.toBe(first);
  expect(read).toHaveBeenCalledTimes(3);
});
