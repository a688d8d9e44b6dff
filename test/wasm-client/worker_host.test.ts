// The worker's half of rrgate-client/worker, from the page's place: a page that takes nothing for a while.
import type { FromHost, ToHost, ToThread } from "../../wasm-client/dist/internal.js";
import type { OpenTransport } from "../../wasm-client/dist/node.js";
import { TestService } from "./service.js";
import { proofOf, startThread } from "./thread_in_place.js";

const definition = `service test.host
stdver 0.10
object Root
  property double speed
  wire double level
  wire double[] picture
  pipe double numbers
  pipe double[] pictures
  event bump(int32 side)
  function void publish_level(double value)
  function void publish_picture(double[] value)
  function void stream_numbers(double value, int32 count)
  function void stream_pictures(double[] value, int32 count)
  function void fire_bump(int32 side)
  callback double ask(double x)
  function double ask_ask(double x)
  function double fail(string name, string text)
end`;

const start = () => TestService.start({ definitions: [definition], root: "test.host.Root" });

type News = FromHost & { kind: "news" };
type Event = News["events"][number];

/** Speaks to one connection, and takes news only when the test says so. */
class Page {
  readonly heard: FromHost[] = [];
  #port: MessagePort;
  #lastId = 0;

  /** `over`: what the service's transport goes over. */
  static async connect(over: (open: OpenTransport) => OpenTransport = (open) => open): Promise<Page> {
    const page = new Page(proofOf(over((await start()).transport)));
    await page.until(({ kind }) => kind === "opened");
    page.begin();
    await page.event(({ kind }) => kind === "connected");
    page.take();
    return page;
  }

  constructor(proof: { token: string }) {
    const { port1, port2 } = new MessageChannel();
    this.#port = port1;
    port1.onmessage = ({ data }: MessageEvent<FromHost>) => this.heard.push(data);
    (port1 as unknown as { unref(): void }).unref();
    const url = "ws://test.example/?service=test";
    startThread().postMessage({ kind: "open", url, proof, port: port2 } satisfies ToThread, [port2]);
  }

  say(message: ToHost): void {
    this.#port.postMessage(message);
  }

  begin(): void {
    this.say({ kind: "core", options: { service: "test", version: 4, stringTable: true, connectTimeout: 10_000 } });
  }

  /** A request on a member of the root. */
  ask(method: string, member: string, ...args: unknown[]): number {
    return this.call(method, ["test", member, ...args], true);
  }

  call(method: string, args: unknown[], isRequest: boolean, size = 8): number {
    const id = ++this.#lastId;
    this.say({ kind: "call", id, method, args, isRequest, isUrgent: false, timeout: 10_000, size });
    return id;
  }

  take(): void {
    this.say({ kind: "taken" });
  }

  /** Takes all that comes until there is this event. */
  async takeUntil(wanted: (event: Event) => boolean): Promise<Event> {
    let taken = 0;
    for (;;) {
      const found = this.events.find(wanted);
      if (found) return found;
      const { length } = this.news;
      for (; taken < length; ++taken) this.take();
      await vi.waitUntil(() => this.news.length > length || this.events.some(wanted));
    }
  }

  get news(): News[] {
    return this.heard.filter((each): each is News => each.kind === "news");
  }

  get events(): Event[] {
    return this.news.flatMap(({ events }) => events);
  }

  async until(wanted: (message: FromHost) => boolean): Promise<void> {
    await vi.waitUntil(() => this.heard.some(wanted));
  }

  async event(wanted: (event: Event) => boolean): Promise<Event> {
    await vi.waitUntil(() => this.events.some(wanted));
    return this.events.find(wanted)!;
  }

  /** Until nothing more comes by itself. */
  async isQuiet(): Promise<void> {
    for (let i = 0; i < 50; ++i) await new Promise((resolve) => setImmediate(resolve));
  }
}

/** Gives what comes in one turn at once. */
const inOne =
  (open: OpenTransport): OpenTransport =>
  (url, listener) => {
    const held: number[] = [];
    const received = (bytes: Uint8Array) => {
      if (held.length === 0) setImmediate(() => listener.received(Uint8Array.from(held.splice(0))));
      held.push(...bytes);
    };
    return open(url, { ...listener, received });
  };

const completed = (id: number) => (event: Event) => event.kind === "completed" && event.id === id;
const valuesOf = (page: Page, kind: string) =>
  page.events.flatMap((event) => (event.kind === kind ? [(event as { value?: unknown }).value] : []));

let page: Page;
beforeEach(async () => {
  page = await Page.connect();
});
afterEach(() => page.say({ kind: "close" }));

it("tells what is there with the first event", () => {
  const connected = page.events.find(({ kind }) => kind === "connected")!;
  expect(connected.seen!.peer!.name).toBe("test.service");
  expect(connected.seen!.attributes!.get("site")).toBe("dock");
  expect(connected.seen!.definitions!.join()).toContain("service test.host");
  expect(connected.seen!.members!.members.map(({ name }) => name)).toContain("speed");
});

it("waits until the page has taken the last batch, and keeps the newest value of a wire", async () => {
  await page.takeUntil(completed(page.ask("connectWire", "level")));
  await page.isQuiet();
  const before = page.news.length;
  for (let i = 1; i <= 100; ++i) page.ask("callFunction", "publish_level", [i]);
  await page.isQuiet();
  const first = page.news.slice(before);
  expect(first).toHaveLength(1); // it is not taken
  const last = page.ask("getProperty", "speed");
  await page.takeUntil(completed(last));
  const values = valuesOf(page, "wire") as number[];
  expect(values.at(-1)).toBe(100);
  expect(values.length).toBeLessThan(5);
  expect(page.events.filter(({ kind }) => kind === "completed").length).toBeGreaterThanOrEqual(101); // of calls, all
});

it("keeps what is on one wire apart from what comes after it was closed", async () => {
  await page.takeUntil(completed(page.ask("connectWire", "level")));
  page.ask("callFunction", "publish_level", [1]);
  await page.isQuiet();
  page.ask("callFunction", "publish_level", [2]);
  page.ask("disconnectWire", "level");
  page.ask("connectWire", "level");
  page.ask("callFunction", "publish_level", [3]);
  await page.takeUntil(completed(page.ask("getProperty", "speed")));
  expect(valuesOf(page, "wire")).toEqual(expect.arrayContaining([2, 3]));
});

it("hands arrays over", async () => {
  const post = vi.spyOn(MessagePort.prototype, "postMessage");
  try {
    page.ask("connectWire", "picture");
    page.ask("callFunction", "publish_picture", [new Float64Array(1000).fill(7)]);
    const { value } = (await page.takeUntil(({ kind }) => kind === "wire")) as unknown as { value: Float64Array };
    expect(value).toHaveLength(1000);
    const transfers = post.mock.calls.flatMap(([, transfer]) => (transfer ?? []) as ArrayBuffer[]);
    const buffers = transfers.filter((each) => each instanceof ArrayBuffer);
    expect(buffers).toHaveLength(1);
    expect(buffers[0]!.byteLength).toBe(0); // the worker has it no more
  } finally {
    post.mockRestore();
  }
});

it("gives packets in batches that a loop keeps up with", async () => {
  await page.takeUntil(completed(page.ask("connectPipe", "numbers", -1, {})));
  await page.takeUntil(completed(page.ask("callFunction", "stream_numbers", [4, 1000])));
  await page.takeUntil(completed(page.ask("getProperty", "speed")));
  expect(valuesOf(page, "pipe")).toHaveLength(1000);
  for (const { events } of page.news) expect(events.length).toBeLessThanOrEqual(256);
});

it("closes an endpoint whose packets nobody takes, after as many as connect() says", async () => {
  await page.takeUntil(completed(page.ask("connectPipe", "numbers", -1, { limit: 300 })));
  await page.isQuiet();
  page.ask("callFunction", "stream_numbers", [4, 200]);
  await page.isQuiet();
  for (let i = 0; i < 5; ++i) page.ask("callFunction", "stream_numbers", [4, 200]);
  await page.isQuiet();
  const closed = (await page.takeUntil(({ kind }) => kind === "pipe_closed")) as Event & { kind: "pipe_closed" };
  expect(closed.error!.name).toBe("RobotRaconteur.OutOfSystemResource");
  expect(closed.error!.message).toContain("more than 300 packets");
  await page.takeUntil(completed(page.ask("getProperty", "speed")));
  expect(valuesOf(page, "pipe").length).toBeLessThanOrEqual(200 + 256 + 301); // nothing comes after it
  // Another one is as good as new.
  const again = (await page.takeUntil(completed(page.ask("connectPipe", "numbers", closed.index, {})))) as Event & {
    kind: "completed";
  };
  expect(Number(again.value)).toBe(closed.index);
  const before = valuesOf(page, "pipe").length;
  page.ask("callFunction", "stream_numbers", [5, 2]);
  await page.takeUntil(completed(page.ask("getProperty", "speed")));
  expect(valuesOf(page, "pipe").slice(before)).toEqual([5, 5]);
});

it("gives none of the packets that came together with those that were too many", async () => {
  page.say({ kind: "close" });
  page = await Page.connect(inOne);
  await page.takeUntil(completed(page.ask("connectPipe", "numbers", -1, { limit: 10 })));
  await page.isQuiet();
  page.ask("callFunction", "stream_numbers", [4, 200]);
  await page.takeUntil(({ kind }) => kind === "pipe_closed");
  await page.takeUntil(completed(page.ask("getProperty", "speed")));
  expect(valuesOf(page, "pipe").length).toBe(11);
  expect(page.events.filter(({ kind }) => kind === "pipe_closed")).toHaveLength(1);
});

it("disconnects a pipe that was given up when its answer was on its way, and not one whose answer was taken", async () => {
  /** Connects, gives it up, and lets the service send to each endpoint. @returns how many have got it. */
  const connectAndCancel = async (isTaken: boolean): Promise<number> => {
    page.take();
    await page.isQuiet();
    const before = valuesOf(page, "pipe").length;
    const id = page.ask("connectPipe", "numbers", -1, {});
    await page.event(completed(id));
    if (isTaken) page.take();
    page.say({ kind: "cancel", id });
    page.ask("callFunction", "stream_numbers", [4, 1]);
    await page.takeUntil(completed(page.ask("getProperty", "speed")));
    return valuesOf(page, "pipe").length - before;
  };
  expect(await connectAndCancel(true)).toBe(1);
  expect(await connectAndCancel(false)).toBe(1); // the first one's
});

it("unlocks what was given up when its answer was on its way", async () => {
  const service = await TestService.start({ definitions: [definition], root: "test.host.Root", requireUser: false });
  page.say({ kind: "close" });
  page = new Page(proofOf(service.transport));
  await page.until(({ kind }) => kind === "opened");
  page.begin();
  await page.event(({ kind }) => kind === "connected");
  await page.takeUntil(completed(page.call("authenticate", ["alice", { password: "secret" }], true)));
  const lock = (kind: string) => page.call("lock", ["test", kind], true);
  const isFree = async () => {
    const id = lock("client");
    const { kind } = await page.takeUntil((event) => "id" in event && event.id === id);
    if (kind === "completed") await page.takeUntil(completed(page.call("unlock", ["test"], true)));
    return kind === "completed";
  };
  page.take();
  await page.isQuiet();
  const given = lock("user");
  await page.event(completed(given));
  page.say({ kind: "cancel", id: given });
  expect(await isFree()).toBe(true);
});

it("counts the bytes of packets, too", async () => {
  await page.takeUntil(completed(page.ask("connectPipe", "pictures", -1, { maxBytes: 100_000 })));
  await page.isQuiet();
  page.ask("getProperty", "speed");
  await page.isQuiet();
  page.ask("callFunction", "stream_pictures", [new Float64Array(2000), 20]);
  const closed = (await page.takeUntil(({ kind }) => kind === "pipe_closed")) as Event & { kind: "pipe_closed" };
  expect(closed.error!.message).toContain("100000 bytes");
});

it("ends the session where events pile up, for they may not be lost", async () => {
  await page.isQuiet();
  for (let i = 0; i < 10_300; ++i) page.ask("callFunction", "fire_bump", [1]);
  await vi.waitUntil(() => page.news.length > 1, 15_000);
  const closed = (await page.takeUntil(({ kind }) => kind === "closed")) as Event & { kind: "closed" };
  expect(closed.error.message).toMatch(/^10001 times event bump waits in the worker and the page takes none/);
  expect(page.events.filter(({ kind }) => kind === "event").length).toBeGreaterThan(10_000); // what came before is told
}, 30_000);

it("says when there is room for more to send", async () => {
  await page.isQuiet();
  const before = page.news.length;
  page.call("setProperty", ["test", "speed", 1], true, 300_000); // as large as the page says
  await page.isQuiet();
  expect(page.news.length).toBeGreaterThan(before);
  expect(page.news.at(-1)!.taken).toBeGreaterThanOrEqual(300_000);
  expect(page.news.at(-1)!.queued).toBe(0);
});

it("tells of a connection that was lost before there was a core, and after it", async () => {
  const service = await start();
  const early = new Page(proofOf(service.transport));
  await early.until(({ kind }) => kind === "opened");
  service.drop("gone");
  early.begin();
  const closed = (await early.event(({ kind }) => kind === "closed")) as Event & { kind: "closed" };
  expect(early.heard).toContainEqual({ kind: "lost", reason: "gone" });
  expect(closed.error.message).toContain("gone");
  early.say({ kind: "close" });
});

it("refuses what does not fit, and nothing is sent", async () => {
  const id = page.ask("setProperty", "speed", "fast");
  const refused = (await page.event(({ kind }) => kind === "refused")) as Event & { kind: "refused" };
  expect([refused.id, refused.error.name]).toEqual([id, "RobotRaconteur.DataTypeMismatch"]);
});
