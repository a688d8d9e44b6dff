// What agents wait for, and asking for access: what the gateway is asked, and what is made of its answers.
import { Store } from "../../web/src/app/store";
import { AccessAsk } from "../../web/src/gateway/access_ask";
import { AgentsDesk, readAgents } from "../../web/src/gateway/agents";
import type { Who } from "../../web/src/gateway/session";

const answer = (status: number, body: unknown = {}) => new Response(JSON.stringify(body), { status });
const admin: Who = { user: "root", roles: ["admin"], login: true, session: true, requests: false, admin: true };

function setup(who: Who | null = admin) {
  const fetch = vi.fn((_path: string, _init?: RequestInit) => Promise.resolve(answer(404)));
  return { fetch, who: new Store(who) };
}

describe("agents", () => {
  const approval = {
    id: "a1",
    user: "bot",
    client: "10.0.0.5",
    device: "arm",
    path: "robot",
    member: "move",
    verb: "call",
  };

  it("are those that wait, as far as the gateway tells of them", () => {
    const given = { ...approval, values: { speed: 1 }, why: "to see", expires_in: 20 };
    expect(readAgents({ approvals: [given, null, { user: "x" }], stopped_for: 5 }, 1_000)).toEqual({
      stoppedUntil: 6_000,
      approvals: [{ ...approval, values: '{"speed":1}', why: "to see", expiresAt: 21_000 }],
    });
    expect(readAgents(null, 1_000)).toEqual({ approvals: [], stoppedUntil: 1_000 });
    expect(readAgents({ stopped_for: 0 }, 1_000).stoppedUntil).toBe(0);
  });

  it("are none where the gateway has no such address, and are forgotten with the right to decide", async () => {
    const session = setup();
    const desk = new AgentsDesk(session);
    expect(await desk.look()).toBe(false);
    expect(desk.state.value).toBeNull();
    session.fetch.mockResolvedValue(answer(200, { approvals: [approval] }));
    expect(await desk.look()).toBe(true);
    expect(desk.state.value?.approvals).toHaveLength(1);
    session.who.value = { ...admin, admin: false };
    expect(desk.state.value).toBeNull();
    session.fetch.mockClear();
    await desk.look();
    expect(session.fetch).not.toHaveBeenCalled();
  });

  it("are told of by notifications while nobody looks at the page, without what the agent says", async () => {
    const shown: { title: string; body: string; isClosed: boolean; close: () => void }[] = [];
    class Shown {
      static permission = "default";
      static requestPermission = vi.fn(() => Promise.resolve((Shown.permission = "granted")));
      constructor(title: string, { body }: { body: string }) {
        const one = { title, body, isClosed: false, close: () => void (one.isClosed = true) };
        shown.push(one);
        return one;
      }
    }
    vi.stubGlobal("Notification", Shown);
    vi.stubGlobal("navigator", {});
    const page = { hidden: true };
    vi.stubGlobal("document", page);
    const session = setup();
    const desk = new AgentsDesk(session);
    const look = async (...approvals: object[]) => {
      session.fetch.mockResolvedValueOnce(answer(200, { approvals }));
      await desk.look();
      await new Promise((resolve) => setTimeout(resolve));
    };
    const mean = { ...approval, why: "Press allow now!" };
    await look(mean);
    expect(shown).toHaveLength(0); // nobody has asked for it
    await desk.notices.ask();
    await look(mean);
    await look(mean, { ...approval, id: "a2", user: "" });
    expect(shown).toMatchObject([
      { title: "The agent of bot asks to do this:", body: "arm · robot.move", isClosed: false },
      { title: "The agent of 10.0.0.5 asks to do this:", isClosed: false },
    ]);
    await look({ ...approval, id: "a2" });
    expect(shown.map(({ isClosed }) => isClosed)).toEqual([true, false]);
    page.hidden = false;
    await look({ ...approval, id: "a2" }, { ...approval, id: "a3" });
    expect(shown.map(({ isClosed }) => isClosed)).toEqual([true, true]);
    vi.unstubAllGlobals();
  });

  it("are known to be as they were last where the gateway does not answer, and it is asked no longer than 5 s", async () => {
    const limits = vi.spyOn(AbortSignal, "timeout");
    const session = setup();
    const desk = new AgentsDesk(session);
    session.fetch.mockResolvedValueOnce(answer(200, { approvals: [approval], stopped_for: 540 }));
    await desk.look();
    const known = desk.state.value;
    const hung = new AbortController();
    limits.mockReturnValueOnce(hung.signal);
    session.fetch.mockImplementationOnce(
      (_, init) =>
        new Promise((_resolve, reject) =>
          init?.signal?.addEventListener("abort", () => reject(new DOMException("signal timed out", "TimeoutError"))),
        ),
    );
    const looks = desk.look();
    hung.abort();
    expect(await looks).toBe(true);
    expect(limits).toHaveBeenLastCalledWith(5_000);
    expect(desk.silence.value).toEqual({ since: expect.any(Number), reason: "the gateway did not answer in time" });
    session.fetch.mockResolvedValueOnce(answer(503, { detail: "starting" }));
    await desk.look();
    expect(desk.silence.value?.reason).toBe("starting");
    session.fetch.mockResolvedValueOnce(answer(429, { detail: "too many requests" }));
    expect(await desk.look()).toBe(true);
    expect(desk.silence.value?.reason).toBe("too many requests");
    expect(desk.state.value).toBe(known);
    session.fetch.mockResolvedValueOnce(answer(200, {}));
    await desk.look();
    expect([desk.silence.value, desk.state.value?.approvals]).toEqual([null, []]);
    limits.mockRestore();
  });

  it("are stopped at once, whatever was asked before, or it is told why not within 4 s", async () => {
    const limits = vi.spyOn(AbortSignal, "timeout");
    const session = setup();
    const desk = new AgentsDesk(session);
    session.fetch.mockResolvedValueOnce(answer(200, {}));
    await desk.look();
    let tellOld: (old: Response) => void = () => undefined;
    session.fetch.mockReturnValueOnce(new Promise((resolve) => (tellOld = resolve)));
    const old = desk.look();
    session.fetch.mockResolvedValueOnce(answer(200, {})).mockReturnValueOnce(new Promise(() => undefined));
    await desk.stop(10);
    expect(limits).toHaveBeenCalledWith(4_000);
    tellOld(answer(200, { stopped_for: 0 }));
    await old;
    expect(desk.state.value?.stoppedUntil).toBeGreaterThan(Date.now() + 590_000);
    session.fetch.mockRejectedValueOnce(new TypeError("Failed to fetch"));
    await expect(desk.stop(10)).rejects.toThrow("the gateway cannot be reached");
    limits.mockRestore();
  });

  it("are answered and stopped, and a refusal is told", async () => {
    const session = setup();
    const desk = new AgentsDesk(session);
    session.fetch.mockImplementation((path) =>
      Promise.resolve(path.endsWith("approvals") ? answer(200, {}) : answer(409, { detail: "too late" })),
    );
    const [waiting] = readAgents({ approvals: [approval] }).approvals;
    if (!waiting) throw new Error("nothing waits");
    await desk.answer(waiting, { answer: "minutes", minutes: 10 });
    const [path, init] = session.fetch.mock.calls[0] ?? [];
    expect([path, init?.method, init?.body]).toEqual([
      "api/v1/agents/approvals/a1",
      "POST",
      '{"answer":"minutes","minutes":10}',
    ]);
    expect(desk.trouble.value).toBe("too late");
    await expect(desk.stop(10)).rejects.toThrow("too late");
    await desk.letGoOn();
    expect(desk.trouble.value).toBe("too late");
    session.fetch.mockImplementation(() => Promise.resolve(answer(200, {})));
    await desk.stop(10);
    await desk.letGoOn();
    const stops = session.fetch.mock.calls
      .filter(([at]) => at === "api/v1/agents/stop")
      .map(([, given]) => given?.body);
    expect(stops.slice(-2)).toEqual(['{"minutes":10}', '{"minutes":0}']);
    expect(desk.trouble.value).toBeNull();
  });
});

describe("a stop of all agents", () => {
  const stop = (devices: unknown) => {
    const session = setup();
    session.fetch.mockImplementation(() => Promise.resolve(answer(200, { ended: 1, stopped_for: 600, devices })));
    return new AgentsDesk(session).stop(10);
  };

  it("has arrived when all devices have answered that they are safe", async () => {
    expect(await stop([{ device: "arm", stopped: "Arm" }])).toBeUndefined();
  });

  it("says which device has not answered yet", async () => {
    const devices = [
      { device: "arm", stopped: "Arm" },
      { device: "cart", sent: "Cart", unanswered: "not yet" },
    ];
    expect(await stop(devices)).toContain("not answered yet: cart");
  });

  it("has failed where a device refuses", async () => {
    await expect(stop([{ device: "arm", refused: "Arm", error: { message: "stuck" } }])).rejects.toThrow(
      "arm refuses: stuck",
    );
  });

  it("tells of all devices that may not be safe, also when it is sent again, until they are or agents may go on", async () => {
    const session = setup();
    const desk = new AgentsDesk(session);
    const given: { devices: object[] } = { devices: [] };
    session.fetch.mockImplementation(() => Promise.resolve(answer(200, { stopped_for: 600, ...given })));
    await desk.look();
    await desk.letGoOn();
    const arm = { device: "arm", refused: "Arm", error: { message: "stuck" } };
    const other = { device: "arm", stopped: "Arm.hand" }; // what another object says is not of this one
    given.devices = [arm, other, { device: "base", sent: "Base", unanswered: "not yet" }, { ...arm, device: "lift" }];
    const all = /^arm refuses: stuck; lift refuses: stuck; .*not answered yet: base$/;
    await expect(desk.stop(10)).rejects.toThrow(all);
    given.devices = []; // no agent commands any more
    await expect(desk.stop(10)).rejects.toThrow(all);
    given.devices = [{ device: "arm", stopped: "Arm" }];
    await expect(desk.stop(10)).rejects.toThrow(/^lift refuses/);
    given.devices = [];
    session.fetch.mockRejectedValueOnce(new TypeError("Failed to fetch"));
    await desk.letGoOn();
    await expect(desk.stop(10)).rejects.toThrow(/^lift refuses/);
    await desk.letGoOn();
    expect(await desk.stop(10)).toBeUndefined();
  });
});

describe("asking for access", () => {
  beforeEach(() => void vi.useFakeTimers());
  afterEach(() => void vi.useRealTimers());

  async function asked() {
    const session = setup(null);
    session.fetch.mockResolvedValueOnce(answer(202, { id: "r/1", secret: "s", expires_in: 3600 }));
    const ask = new AccessAsk(session);
    await ask.ask("tablet", "cell 3");
    return { ask, fetch: session.fetch };
  }

  it("waits for an answer, and is told the token that comes with it once", async () => {
    const { ask, fetch } = await asked();
    expect(ask.state.value).toEqual({ kind: "waiting", name: "tablet" });
    expect(fetch.mock.calls[0]?.[1]?.body).toBe('{"name":"tablet","reason":"cell 3"}');
    fetch.mockRejectedValueOnce(new Error("away")).mockResolvedValueOnce(answer(200, { state: "pending" }));
    await vi.advanceTimersByTimeAsync(6_000);
    expect(ask.state.value.kind).toBe("waiting");
    fetch.mockResolvedValueOnce(answer(200, { state: "approved", token: "rrg_1" }));
    await vi.advanceTimersByTimeAsync(3_000);
    expect(ask.state.value).toEqual({ kind: "approved", token: "rrg_1" });
    const [path, init] = fetch.mock.calls.at(-1) ?? [];
    expect([path, init?.body]).toEqual(["api/v1/access/requests/r%2F1/claim", '{"secret":"s"}']);
    fetch.mockClear();
    await vi.advanceTimersByTimeAsync(60_000);
    expect(fetch).not.toHaveBeenCalled();
  });

  it("is refused, runs out, and is asked after no more when the page goes on", async () => {
    const denied = await asked();
    denied.fetch.mockResolvedValueOnce(answer(200, { state: "denied" }));
    await vi.advanceTimersByTimeAsync(3_000);
    expect(denied.ask.state.value).toEqual({ kind: "refused", why: "denied" });
    const expired = await asked();
    await vi.advanceTimersByTimeAsync(3_000);
    expect(expired.ask.state.value).toEqual({ kind: "refused", why: "expired" });
    const left = await asked();
    left.ask.dispose();
    left.fetch.mockClear();
    await vi.advanceTimersByTimeAsync(60_000);
    expect(left.fetch).not.toHaveBeenCalled();
    const refused = setup(null);
    refused.fetch.mockResolvedValueOnce(answer(429, { detail: "too many" }));
    const ask = new AccessAsk(refused);
    await ask.ask("x", "");
    expect(ask.state.value).toEqual({ kind: "failed", why: "too many" });
  });
});
