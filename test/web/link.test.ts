import { Link } from "../../web/src/robot/link";
import type { Remote } from "../../web/src/robot/remote";

vi.mock("rrgate-client", () => ({
  RobotRaconteurError: class extends Error {},
  connect: () => Promise.reject(new Error("not in this test")),
}));

interface Opening {
  signal: AbortSignal;
  succeed: () => Promise<FakeRemote>;
  fail: (message: string) => Promise<void>;
}

interface FakeRemote {
  remote: Remote;
  closed: () => boolean;
  drop: (reason: string) => void;
}

function fakeRemote(): FakeRemote {
  let heard: (reason: string) => void = () => undefined;
  let closed = false;
  const remote = { type: "a.B", members: [], onClose: (f: typeof heard) => (heard = f), close: () => (closed = true) };
  return { remote: remote as unknown as Remote, closed: () => closed, drop: (reason) => heard(reason) };
}

function setup(): { link: Link; openings: Opening[] } {
  const openings: Opening[] = [];
  const open = (signal: AbortSignal): Promise<Remote> =>
    new Promise((resolve, reject) => {
      openings.push({
        signal,
        succeed: async () => {
          const made = fakeRemote();
          resolve(made.remote);
          await vi.advanceTimersByTimeAsync(0);
          return made;
        },
        fail: async (message) => {
          reject(new Error(message));
          await vi.advanceTimersByTimeAsync(0);
        },
      });
    });
  return { link: new Link(open, () => 0), openings };
}

function at<T>(list: readonly T[], index: number): T {
  const found = list[index];
  if (found === undefined) throw new Error(`no item ${index} in a list of ${list.length}`);
  return found;
}

describe("link", () => {
  beforeEach(() => void vi.useFakeTimers({ now: 1_000_000 }));
  afterEach(() => void vi.useRealTimers());

  it("connects at once", async () => {
    const { link, openings } = setup();
    expect(link.state.value.kind).toBe("connecting");
    await at(openings, 0).succeed();
    expect(link.state.value).toMatchObject({ kind: "online", since: 1_000_000 });
  });
  it("says since when it is lost, through all attempts, and comes back by itself", async () => {
    const { link, openings } = setup();
    const first = await at(openings, 0).succeed();
    first.drop("device create is down");
    expect(link.state.value).toMatchObject({
      kind: "lost",
      since: 1_000_000,
      reason: "device create is down",
      retryAt: 1_000_500,
    });
    await vi.advanceTimersByTimeAsync(500);
    expect(link.state.value).toMatchObject({ kind: "lost", retryAt: null });
    await at(openings, 1).fail("refused");
    expect(link.state.value).toMatchObject({
      kind: "lost",
      since: 1_000_000,
      reason: "refused",
      attempts: 2,
      retryAt: 1_001_500,
    });
    await vi.advanceTimersByTimeAsync(1000);
    await at(openings, 2).succeed();
    expect(link.state.value.kind).toBe("online");
  });
  it("waits anew from the start after a success", async () => {
    const { link, openings } = setup();
    await at(openings, 0).fail("refused");
    await vi.advanceTimersByTimeAsync(500);
    (await at(openings, 1).succeed()).drop("gone");
    expect(link.state.value).toMatchObject({ kind: "lost", retryAt: Date.now() + 500 });
  });
  it("tries at once when the device is back, and only once", async () => {
    const { link, openings } = setup();
    for (let i = 0; i < 5; i++) {
      await at(openings, i).fail("refused");
      if (i < 4) await vi.advanceTimersByTimeAsync(10_000);
    }
    link.deviceIsBack();
    link.deviceIsBack();
    link.retryNow();
    expect(openings).toHaveLength(6);
    await at(openings, 5).succeed();
    await vi.advanceTimersByTimeAsync(60_000);
    expect(openings).toHaveLength(6);
  });
  it("ends with the page: aborts an attempt, closes a connection, never tries again", async () => {
    const attempt = setup();
    attempt.link.dispose();
    expect(at(attempt.openings, 0).signal.aborted).toBe(true);
    expect((await at(attempt.openings, 0).succeed()).closed()).toBe(true);

    const { link, openings } = setup();
    const made = await at(openings, 0).succeed();
    link.dispose();
    link.dispose();
    expect(made.closed()).toBe(true);
    made.drop("closed");
    await vi.advanceTimersByTimeAsync(60_000);
    expect(openings).toHaveLength(1);
  });
});
