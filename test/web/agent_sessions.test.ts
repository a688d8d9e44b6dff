// What agents do: read from whatever the gateway answers, kept while it is away, asked for only while shown.
import { agentSessions, readAgentSessions } from "../../web/src/gateway/agent_sessions";
import type { AgentSession } from "../../web/src/gateway/agent_sessions";
import { polledPage, restsWhileHidden } from "./polled";

/** As the gateway writes it. */
const written = {
  user: "vera",
  client: "10.0.0.5",
  program: "claude-ai 0.1.0",
  begun_ago: 60,
  used_ago: 2.5,
  ended: false,
  reads: 12,
  commands: 2,
  last_commands: [
    { ago: 9, tool: "set", device: "arm", path: "robot/speed", values: "1", state: "failed", detail: "too fast" },
    { ago: 3, tool: "call", device: "arm", path: "robot/move", values: '{"speed":1}', state: "running", detail: "" },
  ],
};

const read: AgentSession = {
  user: "vera",
  client: "10.0.0.5",
  program: "claude-ai 0.1.0",
  begunAt: 40_000,
  usedAt: 97_500,
  ended: false,
  reads: 12,
  commands: 2,
  lastCommands: [
    {
      at: 97_000,
      tool: "call",
      device: "arm",
      path: "robot/move",
      values: '{"speed":1}',
      state: "running",
      detail: "",
    },
    { at: 91_000, tool: "set", device: "arm", path: "robot/speed", values: "1", state: "failed", detail: "too fast" },
  ],
};

describe("sessions of agents", () => {
  it("are read in the order of the gateway, their commands the newest first", () => {
    const other = { ...written, user: "", ended: true, last_commands: [] };
    expect(readAgentSessions({ sessions: [written, other] }, 100_000)).toEqual([
      read,
      { ...read, user: "", ended: true, lastCommands: [] },
    ]);
    expect(readAgentSessions({ sessions: [] })).toEqual([]);
  });

  it("are read as far as they can be", () => {
    const wrong = {
      user: 7,
      client: null,
      program: ["x"],
      begun_ago: "1",
      used_ago: {},
      ended: "yes",
      reads: "many",
      commands: null,
      last_commands: [null, "call", 3, { ago: "now", tool: 1, values: { speed: 1 }, state: true }],
    };
    const nothing = { user: "", client: "", program: "", begunAt: 5, usedAt: 5, ended: false, reads: 0, commands: 0 };
    const noCommand = { at: 5, tool: "", device: "", path: "", values: "", state: "", detail: "" };
    const answer = { sessions: [null, 1, "vera", wrong, {}, { last_commands: { 0: {} } }] };
    expect(readAgentSessions(answer, 5)).toEqual([
      { ...nothing, lastCommands: [noCommand] },
      { ...nothing, lastCommands: [] },
      { ...nothing, lastCommands: [] },
    ]);
    for (const none of [null, undefined, 1, "sessions", [], {}, { sessions: null }, { sessions: { length: 1 } }])
      expect(() => readAgentSessions(none)).toThrow('no list "sessions"');
  });
});

describe("a list of sessions of agents", () => {
  const page = polledPage("/sessions"); // and not who is signed in, after a 401
  const { answers, asked } = page;

  it("is asked again every 2 s, and no more once it is closed", async () => {
    vi.setSystemTime(100_000);
    answers.push(Response.json({ sessions: [written] }), Response.json({ sessions: [] }));
    const list = agentSessions();
    expect(list.state.value).toEqual({ kind: "loading" });
    list.start();
    await vi.advanceTimersByTimeAsync(0);
    expect(list.state.value).toEqual({ kind: "known", items: [read] });
    await vi.advanceTimersByTimeAsync(2000);
    expect(list.state.value).toEqual({ kind: "known", items: [] });
    expect(asked).toEqual(Array(2).fill("https://host/robots/api/v1/agents/sessions"));
    list.stop();
    await vi.advanceTimersByTimeAsync(60_000);
    page.look();
    expect(asked.length).toBe(2);
  });

  it("says who may not see it, and why; without agents, or a list, it is away", async () => {
    answers.push(
      Response.json({ detail: "vera may not" }, { status: 403 }),
      new Response("", { status: 401 }),
      Response.json({ detail: "no agents" }, { status: 404 }),
      Response.json({ sessions: [written] }),
      Response.json([]),
    );
    const list = agentSessions();
    list.start();
    await vi.advanceTimersByTimeAsync(0);
    expect(list.state.value).toEqual({ kind: "denied", reason: "vera may not" });
    await vi.advanceTimersByTimeAsync(2000);
    expect(list.state.value).toEqual({ kind: "denied", reason: "the gateway answered 401" });
    await vi.advanceTimersByTimeAsync(2000);
    expect(list.state.value).toMatchObject({ kind: "away", reason: "no agents", items: null });
    await vi.advanceTimersByTimeAsync(2000);
    expect(list.state.value).toMatchObject({ kind: "known", items: [{ user: "vera" }] });
    await vi.advanceTimersByTimeAsync(2000);
    expect(list.state.value).toMatchObject({ kind: "away", items: [{ user: "vera" }] });
    await vi.advanceTimersByTimeAsync(2000);
    expect(list.state.value).toMatchObject({ reason: "the gateway cannot be reached", items: [{ user: "vera" }] });
    list.stop();
  });

  restsWhileHidden(page, agentSessions);
});
