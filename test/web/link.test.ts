import { keepFound } from "../../web/src/robot/walk";
import { remoteOf } from "../../web/src/robot/remote";
import { controlOf } from "../../web/src/robot/control";
import { Link, openIn } from "../../web/src/robot/link";

/** A subscription in the hands of the test. */
function setup() {
  const heard: Record<string, (news: never) => void> = {};
  const listen = (name: string) => (listener: (news: never) => void) => (heard[name] = listener);
  const subscription = {
    onConnected: listen("connected"),
    onLost: listen("lost"),
    onFailed: listen("failed"),
    onWaiting: listen("waiting"),
    retryNow: vi.fn(),
    close: vi.fn(() => Promise.resolve()),
  };
  const link = new Link("ws://test/devices/create?service=Create", "create", () => subscription as never);
  const tell = (name: string, news: unknown): void => heard[name]?.(news as never);
  return { link, subscription, tell };
}

describe("an object on the way", () => {
  beforeEach(() => void vi.useFakeTimers());
  afterEach(() => void vi.useRealTimers());

  function walkTo(answers: (() => Promise<unknown>)[]) {
    const child = vi.fn(() => answers.shift()?.() ?? Promise.reject(new Error("none left")));
    const root = { type: "a.B", members: [{ name: "arm", kind: "objref", type: "Arm" }], child };
    const found = vi.fn();
    const end = keepFound(root as never, [{ member: "arm", index: null }], found);
    return { child, found, end };
  }
  const arm = () => {
    const info = {
      type: "a.Arm",
      members: [],
      state: "connected",
      onClose: vi.fn((_closed: () => void) => () => undefined),
    };
    const replace = (state: string) => {
      info.state = state;
      for (const [closed] of info.onClose.mock.calls) closed();
    };
    return { remote: remoteOf({ $: info } as never), replace };
  };

  it("is looked up again when the device has put another in its place, and not when the connection ends", async () => {
    const [old, next] = [arm(), arm()];
    const { child, found } = walkTo([() => Promise.resolve(old.remote), () => Promise.resolve(next.remote)]);
    await vi.advanceTimersByTimeAsync(0);
    old.replace("released");
    await vi.advanceTimersByTimeAsync(0);
    expect(found.mock.calls).toEqual([
      [old.remote, ""],
      [null, ""],
      [next.remote, ""],
    ]);
    next.replace("closed");
    await vi.advanceTimersByTimeAsync(60_000);
    expect(child).toHaveBeenCalledTimes(2);
  });
  it("that was not found is looked for again, more and more rarely, while somebody looks", async () => {
    const { remote } = arm();
    const none = () => Promise.reject(new Error("no arm yet"));
    const { child, found, end } = walkTo([none, none, () => Promise.resolve(remote)]);
    await vi.advanceTimersByTimeAsync(1_000);
    expect(found.mock.calls).toEqual([
      [null, "no arm yet"],
      [null, "no arm yet"],
    ]);
    await vi.advanceTimersByTimeAsync(1_900);
    expect(child).toHaveBeenCalledTimes(2);
    await vi.advanceTimersByTimeAsync(100);
    expect(found).toHaveBeenLastCalledWith(remote, "");
    end();
    const never = walkTo([none]);
    await vi.advanceTimersByTimeAsync(0);
    never.end();
    await vi.advanceTimersByTimeAsync(60_000);
    expect(never.child).toHaveBeenCalledOnce();
  });
});

const client = { $: { type: "a.B", members: [] } };

describe("link", () => {
  beforeEach(() => void vi.useFakeTimers({ now: 1_000_000 }));
  afterEach(() => void vi.useRealTimers());

  it("is connecting, then online", () => {
    const { link, tell } = setup();
    expect(link.state.value.kind).toBe("connecting");
    tell("connected", client);
    expect(link.state.value).toMatchObject({
      kind: "online",
      since: 1_000_000,
      remote: { type: "a.B", device: "create" },
    });
  });
  it("says since when it is lost, and when the next attempt begins, through all attempts", () => {
    const { link, tell } = setup();
    tell("connected", client);
    tell("lost", new Error("device create is down"));
    tell("waiting", 500);
    expect(link.state.value).toEqual({
      kind: "lost",
      since: 1_000_000,
      reason: "device create is down",
      retryAt: 1_000_500,
      remote: null,
    });
    vi.advanceTimersByTime(700);
    tell("failed", new Error("refused"));
    tell("waiting", 1000);
    expect(link.state.value).toMatchObject({ since: 1_000_000, reason: "refused", retryAt: 1_001_700 });
    tell("connected", client);
    expect(link.state.value).toMatchObject({ kind: "online", since: 1_000_700 });
  });
  it("tries at once when it is asked to", () => {
    const { link, subscription, tell } = setup();
    tell("failed", new Error("refused"));
    tell("waiting", 10_000);
    link.retryNow();
    expect(subscription.retryNow).toHaveBeenCalledOnce();
    expect(link.state.value).toMatchObject({ kind: "lost", retryAt: 1_000_000 });
  });
  it("is lost while the gateway says that the device is away, but for a stop, until it is back", () => {
    const { link, tell } = setup();
    link.setAway("refused");
    expect(link.state.value.kind).toBe("connecting");
    tell("connected", client);
    const remote = openIn(link.state.value);
    expect(remote).not.toBeNull();
    link.setAway("refused");
    expect(link.state.value).toMatchObject({ kind: "lost", reason: "refused" });
    tell("waiting", 500);
    expect(openIn(link.state.value)).toBe(remote);
    link.setAway(null);
    expect(link.state.value.kind).toBe("online");
    expect(openIn(link.state.value)).not.toBe(remote); // what it had asked for, and its control, are gone
    link.setAway("refused");
    tell("lost", new Error("closed"));
    expect(openIn(link.state.value)).toBeNull();
    link.setAway(null);
    expect(link.state.value).toMatchObject({ kind: "lost", reason: "closed" });
  });
  it("takes the right to command with it, before anybody hears that it is lost", async () => {
    const lease = vi.fn(async () => ({
      onState: () => undefined,
      onLost: () => undefined,
      release: async () => undefined,
    }));
    const { link, tell } = setup();
    const robot = () => {
      const remote = openIn(link.state.value);
      return remote && controlOf({ ...remote, lease } as never);
    };
    for (const lose of [() => link.setAway("refused"), () => tell("lost", new Error("closed"))]) {
      tell("connected", client);
      const control = robot();
      await control?.take();
      expect(control?.mayCommand).toBe(true);
      const seen: boolean[] = [];
      const forget = link.state.watch(() => seen.push(control?.mayCommand === true));
      lose();
      link.setAway(null);
      forget();
      expect(seen).not.toContain(true);
      tell("connected", client);
      expect(robot()?.state.value.kind).toBe("lost");
    }
  });
  it("ends with the page", () => {
    const { link, subscription } = setup();
    link.dispose();
    expect(subscription.close).toHaveBeenCalledOnce();
  });
});
