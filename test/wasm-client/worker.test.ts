// What is rrgate-client/worker's own: its worker, what crosses to it, and what it cannot do. That the rest is as with
// rrgate-client, the tests of that say (vitest.config.ts); how the worker treats a page that is busy, worker_host.test.ts.
import { Core, RemoteCore } from "../../wasm-client/dist/internal.js";
import * as page from "../../wasm-client/dist/node.js";
import type { ConnectOptions } from "../../wasm-client/dist/node.js";
import * as worker from "../../wasm-client/dist/worker.js";
import { failure, settle, TestService } from "./service.js";
import type { NamedObject } from "./service.js";
import { connect, proofOf } from "./thread_in_place.js";

const definition = `service test.worker
stdver 0.10
struct Pair
  field double x
  field double y
end
object Part
  property string name
end
object Root
  property double speed
  property double[] track
  property Pair place
  wire double level
  pipe double echo
  objref Part{string} named
  callback double ask(double x)
  function double ask_ask(double x)
  function void publish_level(double value)
  function void close_echo()
  function double twice(double x)
end`;

const url = "ws://test.example/?service=test";
let service: TestService;
let robot: NamedObject;
const start = async (options: ConnectOptions = {}) => {
  service = await TestService.start({ definitions: [definition], root: "test.worker.Root" });
  return connect(url, { transport: service.transport, ...options });
};
beforeEach(async () => {
  robot = await start();
});
afterEach(async () => {
  vi.unstubAllGlobals();
  await robot.$.close();
});

it("has the exports of rrgate-client, and the same classes", async () => {
  expect(Object.keys(worker).sort()).toEqual(Object.keys(page).sort());
  const error = await failure(robot["speed"]!.set("fast"));
  expect(error).toBeInstanceOf(page.RobotRaconteurError);
  expect(worker.RobotRaconteurError).toBe(page.RobotRaconteurError);
});

it("knows every method of the core that a session uses", () => {
  const own = Object.getOwnPropertyNames(RemoteCore.prototype);
  expect(own).toEqual(expect.arrayContaining(Object.getOwnPropertyNames(Core.prototype)));
});

it("leaves the page its arrays, and sends of a large one the part that it is given", async () => {
  const all = new Float64Array(1_000_000).fill(3);
  const post = vi.spyOn(MessagePort.prototype, "postMessage");
  try {
    await robot["track"]!.set(all.subarray(0, 10));
    const sizes = post.mock.calls.flatMap(([message]) => (message as { size?: number }).size ?? []);
    expect(Math.max(...sizes)).toBeLessThan(1000);
  } finally {
    post.mockRestore();
  }
  expect(all).toHaveLength(1_000_000);
  expect(await robot["track"]!.get()).toStrictEqual(new Float64Array(10).fill(3));
});

it("takes the fields of an instance, not what its class computes", async () => {
  class Place {
    x = 1;
    y = 2;
    get length() {
      return 2;
    }
  }
  await robot["place"]!.set(new Place());
  expect(await robot["place"]!.get()).toEqual({ x: 1, y: 2 });
});

it("finds objects by any index, as the core writes it", async () => {
  for (const index of ["left", "a.b[c]", "grün %", "0"]) {
    const found = (await robot["named"]!.get(index)) as NamedObject;
    expect(await found["name"]!.get()).toBe(`named ${index}`);
    expect(await robot.$.find(found.$.path)).toBe(found);
  }
});

it("is had by an option of connect() and subscribe(), too", async () => {
  const inPage = vi.spyOn(Core, "create");
  for (const open of [page.connect, (...args: Parameters<typeof page.connect>) => page.subscribe(...args).client()]) {
    const other = await TestService.start({ definitions: [definition], root: "test.worker.Root" });
    const asked = (await open(url, { ...proofOf(other.transport), worker: true })) as NamedObject;
    await asked["speed"]!.set(2.5);
    expect(await asked["speed"]!.get()).toBe(2.5);
    await asked.$.close();
  }
  expect(inPage.mock.contexts.length).toBe(2); // the worker's, which is in this thread
  inPage.mockRestore();
});

it("cannot use a transport of the page", async () => {
  const text = "transport: a worker can't use one of the page; use connect() of rrgate-client";
  const transport = service.transport;
  expect((await failure(worker.connect(url, { transport }))).message).toBe(text);
  expect(() => worker.subscribe(url, { transport })).toThrow(text);
});

it("asks a function of the page for the URL, and hands on what it throws", async () => {
  const refusal = new Error("no ticket today");
  expect(await failure(worker.connect(() => Promise.reject(refusal)))).toBe(refusal);
});

it("reports what a handler's value lacks, as in a page", async () => {
  const reports: Error[] = [];
  vi.stubGlobal("reportError", (error: Error) => reports.push(error));
  robot["ask"]!.handler = () => "text";
  expect((await failure(robot["ask_ask"]!(1))).code).toBe(page.ErrorCode.DataTypeMismatch);
  await settle();
  await vi.waitUntil(() => reports.length === 1);
  expect(reports[0]!.message).toContain("found a string, expected double");
  const endless: unknown[] = [];
  endless.push(endless);
  robot["ask"]!.handler = () => endless;
  expect((await failure(robot["ask_ask"]!(1))).code).toBe(page.ErrorCode.DataTypeError);
});

it("keeps a wire that is connected again apart from the end of the one before", async () => {
  const before = robot["level"]!.connect();
  await before.ready;
  void before.close();
  const after = robot["level"]!.connect();
  await after.ready;
  await robot["publish_level"]!(4);
  await vi.waitUntil(() => after.value === 4);
  expect(await robot["level"]!.peek()).toBeTypeOf("number");
});

/** A core whose worker is the test, and what it is told. */
function remote() {
  const core = new RemoteCore(() => undefined);
  const stats = { messagesReceived: 0, messagesSent: 0, bytesReceived: 0, bytesSent: 0 };
  const tell = (...events: Parameters<typeof core.take>[0]["events"]) =>
    core.take({ kind: "news", events, stats, queued: 0, taken: 0 });
  return { core, tell };
}

it("takes the end of a wire for that of the connection before, until the service has answered for the next", () => {
  const { core, tell } = remote();
  const closed = { kind: "wire_closed", path: "test", member: "level" } as const;
  const id = core.connectWire("test", "level");
  tell(closed, { kind: "completed", id, value: null }, closed);
  expect(core.pollEvent()).toMatchObject({ kind: "completed" });
  expect(core.pollEvent()).toEqual(closed);
  core.cancel(core.connectWire("test", "level"));
  tell(closed);
  expect(core.pollEvent()).toEqual(closed);
});

it("rejects what the worker has not answered when the session ends", async () => {
  const { core, tell } = remote();
  const sending = failure(core.sendWire("test", "level", 1));
  const looking = failure(core.definition("test"));
  tell({ kind: "closed", error: { code: 1, name: "RobotRaconteur.ConnectionError", message: "gone" } });
  expect(core.pollEvent()).toMatchObject({ kind: "closed" });
  expect([(await sending).message, (await looking).message]).toEqual(["gone", "gone"]);
});

it("refuses packets where 32 MiB wait for a worker that is busy", async () => {
  const core = new RemoteCore(() => undefined);
  const send = () => core.sendPipePacket("test", "echo", 1, new Float64Array(1_000_000), false, () => undefined);
  for (let i = 0; i < 5; ++i) void send();
  expect((await failure(send())).code).toBe(page.ErrorCode.OutOfSystemResource);
});

it("shows what is known of the session: as of the last news", async () => {
  const { messagesSent } = robot.$.stats;
  await robot["twice"]!(1);
  expect(robot.$.stats.messagesSent).toBe(messagesSent + 1);
});

describe("the worker", () => {
  let fresh: typeof worker;
  beforeEach(async () => {
    vi.resetModules();
    fresh = await import("../../wasm-client/dist/worker.js");
  });

  it("is not to be had everywhere", async () => {
    vi.stubGlobal("Worker", undefined);
    const error = await failure(fresh.connect(url));
    expect(error.name).toBe("RobotRaconteur.SystemResourceError");
    expect(error.message).toBe("the worker could not be started: there are no workers here");
  });

  it("is started with the first connection; one that fails is started again", async () => {
    const made: FailingWorker[] = [];
    class FailingWorker extends EventTarget {
      constructor(
        readonly script: URL,
        readonly options: WorkerOptions,
      ) {
        super();
        made.push(this);
        setTimeout(() => this.dispatchEvent(new Event("error")), 0);
      }
      postMessage(): void {}
    }
    vi.stubGlobal("Worker", FailingWorker);
    for (let attempt = 1; attempt <= 2; ++attempt) {
      const error = await failure(attempt === 1 ? fresh.connect(url) : fresh.preload());
      expect(error.message).toBe("the worker could not be started: its script cannot be loaded");
      expect(made).toHaveLength(attempt);
    }
    expect(made[0]!.script.pathname).toMatch(/\/dist\/worker_thread\.js$/);
    expect(made[0]!.options).toEqual({ type: "module" });
    fresh.init({}); // none is there yet
  });

  it("gets the core from where the page says", async () => {
    const heard: { kind: string; wasm: unknown }[] = [];
    class Thread extends EventTarget {
      postMessage(message: { kind: string; wasm: unknown; port: MessagePort }): void {
        heard.push(message);
        message.port.postMessage({ kind: "done" });
      }
    }
    vi.stubGlobal("location", { href: "https://lab.example/robots/page.html" });
    fresh.init({ wasm: () => "core.wasm", worker: () => new Thread() as unknown as Worker });
    await fresh.preload();
    expect(heard.map(({ kind }) => kind)).toEqual(["start", "preload"]);
    expect(heard[0]!.wasm).toBe("https://lab.example/robots/core.wasm");
    expect(() => fresh.init({})).toThrow("init: the worker is started already; call it first");
  });
});
