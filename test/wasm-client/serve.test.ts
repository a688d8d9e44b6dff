// serve(): a page as a device, with a gateway that is not one. Through a real one: test/interop/test_page_device.py.
import { readFileSync } from "node:fs";
import { ErrorCode, RobotRaconteurError } from "../../wasm-client/dist/node.js";
import type { ObjectInfo } from "../../wasm-client/dist/node.js";
import { platform } from "../../wasm-client/dist/internal.js";
import { serve, type ServedDevice, type ServeOptions } from "../../wasm-client/dist/serve/node.js";
import { ServedEndpoint, ServedPipe } from "../../wasm-client/ts/serve/served_object.js";
import { FakeGateway, type PageSocket } from "./fake_gateway.js";

const definition = `
service test.phone
object Phone
    property string note
    property double level
    property double broken [readonly]
    function double add(double left, double right)
    function void fail(string how)
    function double{generator} count(int32 to)
    function double wait_for_client()
    event tapped(double x, double y)
    wire double[] motion [readonly]
    wire double light
    pipe uint8[] frames
    memory double[] samples
    memory int16[*] grid
    callback double ask(string question)
    function double askMe(string question)
    objref Lamp{string} lamps
    objref varobject thing
end
object Lamp
    property double level
    event burnt()
end`;

interface Lamp {
  $: ObjectInfo;
  level: { get(): Promise<number>; set(value: number): Promise<void> };
}
interface Phone {
  note: { get(): Promise<string>; set(value: string): Promise<void> };
  level: { get(): Promise<number>; set(value: number): Promise<void> };
  broken: { get(): Promise<number> };
  add(left: number, right: number): Promise<number>;
  fail(how: string): Promise<void>;
  count(to: number): AsyncGenerator<number>;
  tapped: { on(handler: (x: number, y: number) => void): () => void };
  motion: { peek(): Promise<Float64Array> };
  light: { poke(value: number): Promise<void>; peekOut(): Promise<number> };
  lamps: { get(index: string): Promise<Lamp> };
}

let gateway: FakeGateway;
let device: ServedDevice;

const implementation = () => ({
  note: "",
  level: {
    get: () => Promise.resolve(implementationLevel),
    set: (value: number) => void (implementationLevel = value),
  },
  broken: "no number",
  add: (left: number, right: number) => Promise.resolve(left + right),
  fail(how: string) {
    if (how === "protocol")
      throw new RobotRaconteurError({
        code: ErrorCode.OutOfRange,
        name: "RobotRaconteur.OutOfRange",
        message: "too far",
      });
    throw new TypeError("a slip");
  },
  *count(to: number) {
    try {
      for (let i = 1; i <= to; ++i) yield i;
    } finally {
      ++ended;
    }
  },
  samples: new Float64Array([1, 2, 3, 4]),
  grid: { dims: [3, 2], data: new Int16Array([1, 2, 3, 4, 5, 6]) },
  askMe: (question: string) => device.caller!.call(device.root, "ask", question),
  lamps: { left: { level: 1 }, right: { level: 2 }, ["a/b"]: { level: 3 } } as Record<string, { level: number }>,
  thing: () => {
    device.emit("tapped", 1, 2);
    return { rrType: "test.phone.Lamp", level: 7 };
  },
});
let implementationLevel = 0;
let ended = 0;

const settings = (more: Partial<ServeOptions>): ServeOptions => ({
  url: "ws://gateway/below",
  name: "phone",
  definition,
  type: "test.phone.Phone",
  object: implementation(),
  ...more,
});
const begin = (more: Partial<ServeOptions> = {}) => serve(settings(more));

beforeEach(async () => {
  gateway = new FakeGateway();
  device = await begin();
});
afterEach(() => device.close());

const textOf = (bytes: string | ArrayBuffer | Uint8Array) => Buffer.from(bytes as Uint8Array).toString("latin1");

const failure = (promise: Promise<unknown>) =>
  promise.then(
    () => expect.unreachable("it has not failed"),
    (error: unknown) => error as RobotRaconteurError,
  );

it("asks the gateway for its name, below the gateway's path", () => {
  expect(gateway.control.url).toBe("ws://gateway/below/serve/phone");
  expect(gateway.control.protocols).toEqual(["rrgate.serve.v1"]);
  expect(device.isServed).toBe(true);
});

it("answers clients by fields, accessors and functions", async () => {
  const phone = await gateway.connect<Phone>();
  await phone.note.set("hello");
  expect(await phone.note.get()).toBe("hello");
  await phone.level.set(4);
  expect([await phone.level.get(), implementationLevel]).toEqual([4, 4]);
  expect(await phone.add(1, 2)).toBe(3);
  const lamp = await phone.lamps.get("left");
  await lamp.level.set(9);
  expect(await (await phone.lamps.get("left")).level.get()).toBe(9);
  expect((await failure(phone.lamps.get("middle"))).code).toBe(ErrorCode.ObjectNotFound);
  await phone.$.close();
});

it("hands on what was thrown, and what is wrong with an answer", async () => {
  const phone = await gateway.connect<Phone>();
  expect(await failure(phone.fail("protocol"))).toMatchObject({ code: ErrorCode.OutOfRange, message: "too far" });
  expect(await failure(phone.fail("other"))).toMatchObject({ name: "TypeError", message: "a slip" });
  const reported: unknown[] = [];
  const report = vi.spyOn(console, "error").mockImplementation((error) => void reported.push(error));
  expect((await failure(phone.broken.get())).message).toContain("broken");
  report.mockRestore();
  expect(reported).toHaveLength(1); // whoever wrote it sees it, too
  await phone.$.close();
});

it("releases all objects behind an objref, or that of one index", async () => {
  await device.close();
  const object = implementation();
  device = await begin({ object });
  const phone = await gateway.connect<Phone>();
  const level = async (index: string) => (await phone.lamps.get(index)).level.get();
  const held = await phone.lamps.get("left");
  expect([await held.level.get(), await level("right")]).toEqual([1, 2]);
  object.lamps = { left: { level: 5 }, right: { level: 6 } };
  device.root.release("lamps", "left");
  await vi.waitFor(() => expect(held.$.state).toBe("released"));
  expect([await level("left"), await level("right")]).toEqual([5, 2]);
  object.lamps = { left: { level: 7 }, right: { level: 8 } };
  device.root.release("lamps");
  await vi.waitFor(async () => expect([await level("left"), await level("right")]).toEqual([7, 8]));
  const later = await gateway.connect<Phone>();
  expect(await (await later.lamps.get("left")).level.get()).toBe(7);
  expect(() => device.root.release("thing", "left")).toThrow(/"thing" has no index/);
  for (const each of [phone, later]) await each.$.close();
});

it("releases an object as its clients spell it", async () => {
  const told: string[] = [];
  const phone = await gateway.connect<Phone>((socket) => {
    const tell = socket.tell.bind(socket);
    socket.tell = (data) => tell(Uint8Array.from(Buffer.from(textOf(data).replaceAll("%2f", "%2F"), "latin1")).buffer);
    socket.send = new Proxy(socket.send, {
      apply: (send, self, [data]: [Uint8Array]) => (told.push(textOf(data)), send.call(self, data)),
    });
  });
  await (await phone.lamps.get("a/b")).level.get();
  told.length = 0;
  device.root.release("lamps", "a/b");
  expect(told.join()).toMatch(/Phone\.lamps\[a%2Fb]/);
  await phone.$.close();
});

it("does nothing else while an object is looked for", async () => {
  const phone = await gateway.connect<{ thing: { get(): Promise<unknown> } } & Phone>();
  const error = await failure(phone.thing.get());
  expect(error).toMatchObject({ code: ErrorCode.InvalidOperation });
  expect(error.message).toContain("may not use members of the device");
  expect(await phone.add(1, 2)).toBe(3);
  await phone.$.close();
});

it("ends a generator whose client is gone before there is one", async () => {
  await device.close();
  const events: string[] = [];
  let give!: (steps: unknown) => void;
  const count = () => (events.push("asked"), new Promise((resolve) => (give = resolve)));
  let socket!: PageSocket;
  device = await begin({ object: { ...implementation(), count } });
  const phone = await gateway.connect<Phone>((made) => (socket = made));
  const step = failure(phone.count(5).next());
  await vi.waitFor(() => expect(events).toEqual(["asked"]));
  socket.end(1006, "");
  give({
    next: () => events.push("next"),
    return: () => (events.push("ended"), { done: true, value: undefined }),
  });
  await vi.waitFor(() => expect(events).toEqual(["asked", "ended"]));
  await phone.$.close();
  await step;
});

it("ends the generators of a client that goes", async () => {
  ended = 0;
  const phone = await gateway.connect<Phone>();
  const generator = phone.count(5);
  expect((await generator.next()).value).toBe(1);
  await phone.$.close();
  await vi.waitFor(() => expect(ended).toBe(1));
});

it("tells values of wires to those who come later, and errors to those who set what does not fit", async () => {
  device.root.setWire("motion", [1, 2, 3]);
  const phone = await gateway.connect<Phone>();
  expect(Array.from(await phone.motion.peek())).toEqual([1, 2, 3]);
  expect((await failure(phone.light.peekOut())).code).toBe(ErrorCode.ValueNotSet);
  await phone.light.poke(0.5);
  expect(await phone.light.peekOut()).toBe(0.5);
  expect(() => device.root.setWire("motion", "fast")).toThrow(/motion/);
  expect(() => device.root.setWire("tapped", 1)).toThrow(/no wire "tapped"/);
  expect(() => device.emit("tapped", 1, "two")).toThrow(/y/);
  await phone.$.close();
});

it("lets a sender of packets wait for the slowest client, and not for one that goes", async () => {
  let socket: PageSocket | undefined;
  const phone = await gateway.connect<{ frames: { connect(): Promise<{ close(): Promise<void> }> } }>(
    (made) => (socket = made),
  );
  await phone.frames.connect();
  const pipe = device.root.pipe("frames");
  expect(pipe.endpoints.size).toBe(1);
  await pipe.send(new Uint8Array(1000));
  socket!.bufferedAmount = 10_000_000;
  let isSent = false;
  const sending = pipe.send(new Uint8Array(1000)).then(() => (isSent = true));
  await new Promise((resolve) => setTimeout(resolve));
  expect(isSent).toBe(false);
  socket!.end(1006, "");
  await sending;
  expect(pipe.endpoints.size).toBe(0);
});

it.each([
  ["64 MiB", 1024 * 1024, 64],
  ["10,000", 1, 10_000],
])("keeps the newest packets of a client, %s at most", async (_, size, count) => {
  const endpoint = new ServedEndpoint({ closePipe: () => undefined } as never, new ServedPipe(), 1, 1, 0);
  const packets = Array.from({ length: count + 3 }, () => new Uint8Array(size));
  for (const packet of packets) endpoint.take(packet);
  endpoint.take(new Uint8Array(2 * size)); // for two of 1 MiB
  endpoint.close();
  const left: unknown[] = [];
  for await (const packet of endpoint) left.push(packet);
  const first = packets.indexOf(left[0] as Uint8Array<ArrayBuffer>);
  expect([first, left.length]).toEqual(size > 1 ? [5, count - 1] : [4, count]);
});

it("lets the next client in when the one who has an object to itself leaves, or is gone", async () => {
  const phones = await Promise.all([1, 2, 3].map(() => gateway.connect<Phone>()));
  const entered: number[] = [];
  const leave: (() => void)[] = [];
  const turns: Promise<void>[] = [];
  const enter = async (i: number) => {
    const stay = () => (entered.push(i), new Promise<void>((resolve) => leave.push(resolve)));
    turns.push(phones[i]!.$.monitor(stay));
    await phones[i]!.note.get().catch(() => undefined); // its request is there
  };
  for (const i of [0, 1, 2]) await enter(i);
  expect(entered).toEqual([0]);
  leave[0]!();
  await vi.waitFor(() => expect(entered).toEqual([0, 1]));
  const settled = Promise.allSettled(turns);
  void phones[1]!.$.close();
  await vi.waitFor(() => expect(entered).toEqual([0, 1, 2]));
  for (const each of leave) each();
  expect((await settled).map(({ status }) => status)).toEqual(["fulfilled", "rejected", "fulfilled"]);
  for (const phone of phones) await phone.$.close();
});

it("answers calls back and gives events to all", async () => {
  const both = await Promise.all([gateway.connect<Phone>(), gateway.connect<Phone>()]);
  const heard = both.map((phone) => new Promise((resolve) => phone.tapped.on((x, y) => resolve([x, y]))));
  device.emit("tapped", 1, 2);
  expect(await Promise.all(heard)).toEqual([
    [1, 2],
    [1, 2],
  ]);
  const [asking] = both as unknown as [{ ask: unknown; askMe(question: string): Promise<number> }];
  (asking.ask as { handler: unknown }).handler = (question: string) => question.length;
  expect(await asking.askMe("four")).toBe(4);
  for (const phone of both) await phone.$.close();
});

it("may be closed by what finds an object", async () => {
  await device.close();
  let closing: Promise<void> | undefined;
  const lamps = () => ((closing = device.close()), { level: 1 });
  device = await begin({ object: { ...implementation(), lamps } });
  const phone = await gateway.connect<Phone>();
  const ended = new Promise((resolve) => phone.$.onClose(resolve));
  void failure(phone.lamps.get("left")).catch(() => undefined);
  expect(await ended).toMatchObject({ message: expect.stringContaining("the service was closed") as string });
  await closing;
  expect([device.isServed, gateway.control.isClosed]).toEqual([false, true]);
});

it("comes back when the connection is lost, and not when it is closed", async () => {
  const news: [boolean, string][] = [];
  await device.close();
  device = await begin({ onChange: (...change) => void news.push(change) });
  const { nodeId } = device;
  gateway.control.end(1001, "the gateway is stopping");
  expect(device.isServed).toBe(false);
  await vi.waitFor(() => expect(device.isServed).toBe(true));
  expect(news).toEqual([
    [true, ""],
    [false, "the gateway is stopping"],
    [true, ""],
  ]);
  expect(device.nodeId).toBe(nodeId);
  const count = gateway.controls.length;
  await device.close();
  expect(gateway.control.isClosed).toBe(true);
  expect(gateway.controls).toHaveLength(count);
});

it("rejects with what the gateway says", async () => {
  gateway.answer = (control) => control.end(1008, "there is a device 'phone' already");
  const error = await failure(begin());
  expect(error).toMatchObject({ code: ErrorCode.ConnectionError });
  expect(error.message).toContain("there is a device 'phone' already");
  gateway.answer = () => undefined;
  expect((await failure(begin({ timeout: 20 }))).code).toBe(ErrorCode.RequestTimeout);
});

describe.each(["the function that gives the URL", "ws://gateway/below/serve/phone"])("waits for %s", (where) => {
  let url: () => string | Promise<string>;
  /** From now on there is no URL, or no ticket for it. */
  const hang = (asked: () => void) => {
    const never = () => (asked(), new Promise<never>(() => undefined));
    if (where.startsWith("ws:")) platform.findWebsocket = never;
    else url = never;
  };
  beforeEach(() => (url = () => "ws://gateway/below"));

  it("until the timeout", async () => {
    hang(() => undefined);
    const error = await failure(begin({ url: () => url(), timeout: 20 }));
    expect(error).toMatchObject({ code: ErrorCode.RequestTimeout, message: `${where}: no answer within 20 ms` });
  });

  it("until it is aborted", async () => {
    const giving = new AbortController();
    const reason = new Error("the page has changed its mind");
    hang(() => queueMicrotask(() => giving.abort(reason)));
    expect(await failure(begin({ url: () => url(), signal: giving.signal }))).toBe(reason);
  });

  it("until the next attempt, where the connection was lost", async () => {
    await device.close();
    const news: string[] = [];
    const options = settings({ url: () => url(), onChange: (_, reason) => void news.push(reason) });
    device = await serve(options);
    const { findWebsocket } = platform;
    options.timeout = 20;
    hang(() => {
      url = () => "ws://gateway/below";
      platform.findWebsocket = findWebsocket;
      options.timeout = undefined;
    });
    gateway.control.end(1001, "gone");
    await vi.waitFor(() => expect(device.isServed).toBe(true), 5_000);
    expect(news).toEqual(["", "gone", `${where}: no answer within 20 ms`, ""]);
  });
});

it("opens no connection for a URL that comes too late", async () => {
  let give!: (url: string) => void;
  const giving = new AbortController();
  const url = () => new Promise<string>((resolve) => (give = resolve));
  const beginning = failure(begin({ url, signal: giving.signal }));
  await vi.waitFor(() => expect(give).toBeDefined());
  const count = gateway.controls.length;
  giving.abort();
  give("ws://gateway/below");
  expect(await beginning).toBe(giving.signal.reason);
  expect(gateway.controls).toHaveLength(count);
});

it("rejects definitions that are wrong, and what is no object of them", async () => {
  const wrong = await failure(begin({ definition: definition.replace("double level", "dubble level") }));
  expect(wrong.code).toBe(ErrorCode.ServiceDefinitionError);
  expect(wrong.message).toContain("dubble");
  expect((await failure(begin({ type: "test.phone.Tablet" }))).code).toBe(ErrorCode.ServiceDefinitionError);
  expect((await failure(begin({ nodeId: "me" }))).code).toBe(ErrorCode.InvalidArgument);
});

it("ends a client that talks garbage, and no other", async () => {
  const phone = await gateway.connect<Phone>();
  const noise = await gateway.open();
  await new Promise((resolve) => setTimeout(resolve)); // the page listens
  noise.tell(new TextEncoder().encode("RRACnonsense".repeat(9)).buffer);
  expect(noise.isClosed).toBe(true);
  expect(await phone.add(1, 2)).toBe(3);
  await phone.$.close();
});

it("does what the documentation says", async () => {
  await device.close();
  const page = readFileSync(new URL("../../docs/serve.md", import.meta.url), "utf8");
  const code = /```js\n(.*?)```/s
    .exec(page)![1]!
    .replace(/^import .*$/m, "")
    .replace('url: "/"', 'url: "ws://gateway/"');
  const handlers: Record<string, (event: object) => void> = {};
  const listen = (name: string, handler: (event: object) => void) => void (handlers[name] = handler);
  const document = { body: { style: { opacity: "1" } } };
  const AsyncFunction = (async () => undefined).constructor as new (
    ...text: string[]
  ) => (...given: unknown[]) => Promise<ServedDevice>;
  const example = new AsyncFunction("serve", "addEventListener", "document", `${code}; return device;`);
  device = await example(serve, listen, document);
  handlers["devicemotion"]!({ acceleration: { x: 1, y: 2, z: 3 } });

  interface Example extends Omit<Phone, "motion" | "light" | "ask_me"> {
    acceleration: Phone["motion"];
    brightness: { poke(value: number): Promise<void> };
    chat: { connect(): Promise<AsyncIterable<string> & { send(text: string): Promise<void> }> };
    samples: { read(position: number, count: number): Promise<Float64Array> };
  }
  const phone = await gateway.connect<Example>();
  expect(Array.from(await phone.acceleration.peek())).toEqual([1, 2, 3]);
  await phone.brightness.poke(0.5);
  expect(document.body.style.opacity).toBe("0.5");
  const counted: number[] = [];
  for await (const number of phone.count(3)) counted.push(number);
  expect(counted).toEqual([1, 2, 3]);
  const chat = await phone.chat.connect();
  await chat.send("hello");
  for await (const text of chat) {
    expect(text).toBe("HELLO");
    break;
  }
  expect(await phone.samples.read(98, 2)).toEqual(new Float64Array(2));
  const tapped = new Promise((resolve) => phone.tapped.on((x, y) => resolve([x, y])));
  handlers["pointerdown"]!({ clientX: 4, clientY: 5 });
  expect(await tapped).toEqual([4, 5]);
  expect(await (await phone.lamps.get("right")).level.get()).toBe(0);
  await phone.$.close();
});
