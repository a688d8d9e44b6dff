// Subscriptions: connections come and go, the waits between are in the hands of the test.
import { ErrorCode, findServices, RobotRaconteurError } from "../../wasm-client/dist/node.js";
import type { Clock, OpenTransport, SubscribeOptions } from "../../wasm-client/dist/node.js";
import { Core } from "../../wasm-client/dist/internal.js";
import { failure, settle, subscribe, TestService } from "./service.js";
import type { NamedObject } from "./service.js";

const definition = `service test.subscribe
stdver 0.10
object Part
  property string name
  wire double level
end
object Root
  property double speed
  wire double both
  wire double other
  pipe double echo
  objref Part part
  function double twice(double x)
  function void publish_both(double x)
  function void hang()
  function void stream_echo(double x, int32 count)
  pipe double[] blocks
  function void stream_blocks(double[] block, int32 count)
  event filled(double[] block)
  function void fire_filled(double[] block)
  function void close_echo()
end`;

const url = "ws://one/?service=test";
const start = () => TestService.start({ definitions: [definition], root: "test.subscribe.Root" });

/** Waits that end when the test says so. */
class ManualClock implements Clock {
  readonly waits: { milliseconds: number; due: () => void }[] = [];

  after(milliseconds: number, due: () => void): () => void {
    const wait = { milliseconds, due };
    this.waits.push(wait);
    return () => void (this.waits.includes(wait) && this.waits.splice(this.waits.indexOf(wait), 1));
  }

  /** Ends the only wait. @returns how long it was. */
  fire(): number {
    expect(this.waits).toHaveLength(1);
    const wait = this.waits.shift()!;
    wait.due();
    return wait.milliseconds;
  }
}

/** One service for each connection, in turn; an Error refuses the connection. */
function inTurn(...services: (TestService | Error)[]): OpenTransport {
  return (to, listener) => {
    const service = services.shift() ?? new Error("nobody is there");
    if (service instanceof Error) throw service;
    return service.transport(to, listener);
  };
}

let clock: ManualClock;
const follow = (transport: OpenTransport, options: SubscribeOptions = {}) =>
  subscribe<NamedObject>(url, { transport, clock, random: () => 0.5, ...options });

beforeEach(() => {
  clock = new ManualClock();
});

it("connects, and again after a loss; what was under way rejects as lost", async () => {
  const first = await start();
  const subscription = follow(inTurn(first, await start()));
  const lost: RobotRaconteurError[] = [];
  const connected: unknown[] = [];
  subscription.onLost((reason) => lost.push(reason));
  subscription.onConnected((client) => connected.push(client));
  expect(subscription.defaultClient).toBeUndefined();
  const client = await subscription.client();
  expect(subscription.defaultClient).toBe(client);
  expect(await client["twice"]!(4)).toBe(4);

  const underWay = failure(client["hang"]!());
  await settle();
  first.drop("the cable is out");
  const error = await underWay;
  expect(error).toBeInstanceOf(RobotRaconteurError);
  expect(error.code).toBe(ErrorCode.ConnectionError);
  expect(error.subName).toBe("connection_lost");
  expect(error.message).toContain("the cable is out");
  expect(lost.map(({ subName }) => subName)).toEqual(["connection_lost"]);
  expect(subscription.defaultClient).toBeUndefined();
  expect((await failure(client["twice"]!(1))).subName).toBe("connection_lost");

  const waiting = subscription.client();
  expect(clock.fire()).toBe(375);
  const next = await waiting;
  expect(next).not.toBe(client);
  expect(await next["twice"]!(5)).toBe(5);
  expect(connected).toEqual([client, next]);
  await subscription.close();
});

it("asks a function for the URL at each attempt, and tells what it throws", async () => {
  const opened: string[] = [];
  const transport: OpenTransport = (to) => {
    opened.push(to.search);
    throw new Error("nobody is there");
  };
  let tickets = 0;
  const source = () => {
    if (++tickets === 2) throw new Error("no ticket today");
    return Promise.resolve(`${url}&ticket=${tickets}`);
  };
  const subscription = subscribe(source, { transport, clock });
  const failures: [string, string][] = [];
  subscription.onFailed((error, of) => failures.push([(error as Error).message, of]));
  await settle();
  clock.fire();
  await settle();
  clock.fire();
  await settle();
  expect(opened).toEqual(["?service=test&ticket=1", "?service=test&ticket=3"]);
  expect(failures).toEqual(["nobody is there", "no ticket today", "nobody is there"].map((why) => [why, ""]));
  await subscription.close();
});

it("is not sent again what it knows of the service, unless that has changed", async () => {
  const withForce = definition.replace("property double speed", "property double speed\n  property double force");
  const begin = (text: string) => TestService.start({ definitions: [text], root: "test.subscribe.Root" });
  const services = [];
  for (const text of [definition, definition, definition, withForce, withForce]) services.push(await begin(text));
  const subscription = follow(inTurn(...services));
  const received: number[] = [];
  const types: (readonly string[])[] = [];
  for (const [number, service] of services.entries()) {
    const client = await subscription.client();
    received.push(client.$.stats.bytesReceived);
    types.push(client.$.types);
    expect("force" in client).toBe(number >= 3);
    expect(await client["twice"]!(number)).toBe(number);
    service.drop("gone");
    await settle();
    clock.fire();
  }
  const [full, known, again, changed, knownToo] = received as [number, number, number, number, number];
  expect(known).toBeLessThan(full - definition.length);
  expect(again).toBe(known);
  expect(changed).toBeGreaterThan(full);
  expect(knownToo).toBe(known);
  expect(types).toEqual([[definition], [definition], [definition], [withForce], [withForce]]);
  await subscription.close();
});

it("asks nothing of a core that has failed, and connects again", async () => {
  const begin = () => TestService.start({ definitions: [definition], root: "test.subscribe.Root" });
  const subscription = follow(inTurn(await begin(), await begin()));
  const client = await subscription.client();
  const asked = vi.spyOn(Core.prototype, "knownDefinitions");
  vi.spyOn(Core.prototype, "handleBytes").mockImplementationOnce(() => {
    throw new WebAssembly.RuntimeError("Out of bounds memory access");
  });
  const error = await failure(client["twice"]!(1));
  expect(error.message).toBe("the session failed: Out of bounds memory access");
  clock.fire();
  expect(await (await subscription.client())["twice"]!(2)).toBe(2);
  expect(asked).not.toHaveBeenCalled();
  vi.restoreAllMocks();
  await subscription.close();
});

it("ends a session whose core fails in a request or a packet, and connects again", async () => {
  const subscription = follow(inTurn(await start(), await start(), await start()));
  const broken = new WebAssembly.RuntimeError("unreachable");
  const deep = new RangeError("Maximum call stack size exceeded");
  const fail = (method: "callFunction" | "sendWire", error: Error) =>
    vi.spyOn(Core.prototype, method).mockImplementationOnce(() => {
      throw error;
    });
  const asked = vi.spyOn(Core.prototype, "knownDefinitions");
  const lost: string[] = [];
  subscription.onLost(({ message }) => lost.push(message));

  fail("callFunction", broken);
  const calling = await failure((await subscription.client())["twice"]!(1));
  expect([calling.code, calling.message]).toEqual([ErrorCode.InternalError, "the session failed: unreachable"]);
  clock.fire();
  const wire = (await subscription.client())["both"]!.connect();
  await wire.ready;
  fail("sendWire", deep);
  expect((await failure(wire.send(1))).message).toBe("the session failed: Maximum call stack size exceeded");
  clock.fire();
  expect(await (await subscription.client())["twice"]!(2)).toBe(2);
  expect(lost).toEqual([broken, deep].map(({ message }) => `the session failed: ${message}`));
  expect(asked).not.toHaveBeenCalled();
  vi.restoreAllMocks();
  await subscription.close();
});

it("waits longer after each failure, up to a limit, and starts again after a success", async () => {
  const chances = [0, 0.999];
  let turn = 0;
  const service = await start();
  const refused = Array.from({ length: 9 }, (_, index) => new Error(`refused ${index}`));
  const subscription = follow(inTurn(...refused, service, new Error("gone")), { random: () => chances[turn++ % 2]! });
  const failed: string[] = [];
  subscription.onFailed((error, to) => failed.push(`${to} ${(error as Error).message}`));
  const waits: number[] = [];
  for (let i = 0; i < 9; ++i) {
    await vi.waitUntil(() => clock.waits.length > 0);
    waits.push(Math.round(clock.fire()));
  }
  expect(waits).toEqual([250, 1000, 1000, 3998, 4000, 15992, 15000, 29985, 15000]);
  await subscription.client();
  expect(failed).toHaveLength(9);
  expect(failed[8]).toBe(`${url} refused 8`);
  service.drop("gone");
  await settle();
  expect(Math.round(clock.fire())).toBe(500);
  await subscription.close();
});

it("says how long it waits, and attempts at once when it is asked to", async () => {
  const refused = Array.from({ length: 3 }, () => new Error("refused"));
  const connections = inTurn(...refused, await start());
  let attempts = 0;
  const subscription = follow((to, listener) => (++attempts, connections(to, listener)));
  const waits: number[] = [];
  subscription.onWaiting((milliseconds) => waits.push(milliseconds));
  await vi.waitUntil(() => clock.waits.length > 0);
  clock.fire();
  await vi.waitUntil(() => clock.waits.length > 0);
  subscription.retryNow();
  subscription.retryNow(); // it does already
  expect(clock.waits).toHaveLength(0);
  await vi.waitUntil(() => clock.waits.length > 0);
  expect(waits).toEqual([375, 750, 375]);
  expect(attempts).toBe(3);
  subscription.retryNow();
  await subscription.client();
  subscription.retryNow(); // it is connected
  await settle();
  expect(attempts).toBe(4);
  await subscription.close();
});

it("tries the ways to a service in order", async () => {
  const tried: string[] = [];
  const service = await start();
  const transport: OpenTransport = (to, listener) => {
    tried.push(to.host);
    if (to.host !== "three") throw new Error("refused");
    return service.transport(to, listener);
  };
  const urls = ["ws://one/?service=test", "ws://two/?service=test", "ws://three/?service=test"];
  const subscription = subscribe(urls, { transport, clock });
  await subscription.client();
  expect(tried).toEqual(["one", "two", "three"]);
  await subscription.close();
  expect(() => subscribe(["ws://one/?service=a", "ws://two/?service=b"])).toThrow("the services a, b");
  expect(() => subscribe([])).toThrow("no URL");
});

it("ends with close(), whatever it is doing", async () => {
  const service = await start();
  const subscription = follow(inTurn(service));
  const client = await subscription.client();
  const closing = subscription.close();
  expect(subscription.close()).toBe(closing);
  await closing;
  expect(client.$.state).toBe("closed");
  expect(subscription.defaultClient).toBeUndefined();
  expect((await failure(subscription.client())).code).toBe(ErrorCode.InvalidOperation);
  expect(clock.waits).toHaveLength(0);

  const waiting = follow(inTurn());
  const wanted = failure(waiting.client());
  await vi.waitUntil(() => clock.waits.length > 0);
  await waiting.close();
  expect(clock.waits).toHaveLength(0);
  expect((await wanted).code).toBe(ErrorCode.InvalidOperation);

  const abort = new AbortController();
  const connecting = follow(() => new Promise(() => undefined), { signal: abort.signal });
  abort.abort();
  expect(connecting.isClosed).toBe(true);
  await settle();
  expect(clock.waits).toHaveLength(0);
  expect(follow(inTurn(), { signal: AbortSignal.abort() }).isClosed).toBe(true);
});

it("gives the client within limits", async () => {
  const subscription = follow(() => new Promise(() => undefined));
  const abort = new AbortController();
  const aborted = failure(subscription.client({ signal: abort.signal }));
  abort.abort(new Error("enough"));
  expect((await aborted).message).toBe("enough");
  const late = failure(subscription.client({ timeout: 100 }));
  expect(clock.fire()).toBe(100);
  expect((await late).code).toBe(ErrorCode.RequestTimeout);
  await subscription.close();
});

it("gives the client as late as it is told to: later than timers of the engine can", async () => {
  vi.useFakeTimers({ toFake: ["setTimeout", "clearTimeout"] });
  const transport: OpenTransport = () => new Promise(() => undefined);
  const subscription = subscribe(url, { transport });
  let isOver = false;
  void failure(subscription.client({ timeout: Infinity })).then(() => (isOver = true));
  await vi.advanceTimersByTimeAsync(1000);
  expect(isOver).toBe(false);
  vi.useRealTimers();
  await subscription.close();
});

it("keeps a wire over connections", async () => {
  const first = await start();
  const second = await start();
  const subscription = follow(inTurn(first, second));
  const wire = subscription.wire("both");
  expect((await failure(wire.send(1))).code).toBe(ErrorCode.InvalidOperation);
  const seen: unknown[] = [];
  const loop = (async () => {
    for await (const value of wire) seen.push(value);
  })();
  const client = await subscription.client();
  await vi.waitUntil(() => wire.isConnected);
  await client["publish_both"]!(1);
  await vi.waitUntil(() => seen.length === 1);
  expect((await wire.losses())!.delivered).toBe(1);
  first.drop("gone");
  await vi.waitUntil(() => !wire.isConnected);
  expect(await wire.losses()).toBeUndefined();
  expect(wire.value).toBe(1);
  clock.fire();
  const next = await subscription.client();
  await vi.waitUntil(() => wire.isConnected);
  await next["publish_both"]!(2);
  await vi.waitUntil(() => seen.length === 2);
  await wire.send(3);
  expect(await vi.waitUntil(async () => (await next["both"]!.peekOut()) === 3)).toBe(true);
  await subscription.close();
  await loop;
  expect(seen).toEqual([1, 2]);
  expect(wire.value).toBe(2);
});

it("finds the object of a member, and tries again where that fails", async () => {
  const service = await start();
  const subscription = follow(inTurn(service));
  const level = subscription.wire("level", { path: "*.part" });
  const wrong = subscription.wire("level", { path: "*" });
  const failures: unknown[] = [];
  wrong.onFailed((error) => failures.push(error));
  await subscription.client();
  await vi.waitUntil(() => level.isConnected && clock.waits.length === 1);
  expect((failures[0] as RobotRaconteurError).code).toBe(ErrorCode.MemberNotFound);
  expect(clock.fire()).toBe(2_500);
  await vi.waitUntil(() => clock.waits.length === 1);
  expect(failures).toHaveLength(2);
  await wrong.close();
  expect(clock.waits).toHaveLength(0);
  for await (const _ of wrong) throw new Error("it is closed");
  await subscription.close();
  expect(level.isConnected).toBe(false);
});

it("ends a wire with the loop over it", async () => {
  const service = await start();
  const subscription = follow(inTurn(service));
  const wire = subscription.wire("both");
  const client = await subscription.client();
  await vi.waitUntil(() => wire.isConnected);
  await client["publish_both"]!(1);
  for await (const value of wire) {
    expect(value).toBe(1);
    break;
  }
  await vi.waitUntil(() => !wire.isConnected);
  expect(client.$.state).toBe("connected");
  await subscription.close();
});

it("keeps a pipe over connections, without losing what came", async () => {
  const first = await start();
  const subscription = follow(inTurn(first, await start()));
  const pipe = subscription.pipe("echo", { limit: 100 });
  const seen: unknown[] = [];
  const loop = (async () => {
    for await (const packet of pipe) seen.push(packet);
  })();
  const client = await subscription.client();
  await vi.waitUntil(() => pipe.isConnected);
  await client["stream_echo"]!(1, 50);
  await vi.waitUntil(() => seen.length === 50);

  await client["close_echo"]!();
  await vi.waitUntil(() => clock.waits.length === 1);
  expect(clock.fire()).toBe(2_500);
  await vi.waitUntil(() => pipe.isConnected);
  await pipe.send(2);
  await vi.waitUntil(() => seen.length === 51);

  first.drop("gone");
  await vi.waitUntil(() => !pipe.isConnected);
  clock.fire();
  const next = await subscription.client();
  await vi.waitUntil(() => pipe.isConnected);
  await next["stream_echo"]!(3, 1);
  await vi.waitUntil(() => seen.length === 52);
  expect(seen.slice(49)).toEqual([1, 2, 3]);
  await pipe.close();
  await loop;
  expect(next.$.state).toBe("connected");
  await subscription.close();
});

it("connects a member once that is wanted because of the new state", async () => {
  const subscription = follow(inTurn(await start()));
  const seen: unknown[] = [];
  subscription.state.subscribe(({ status }) => {
    if (status !== "connected") return;
    const pipe = subscription.pipe("echo");
    void (async () => {
      for await (const packet of pipe) seen.push(packet);
    })();
  });
  const client = await subscription.client();
  await settle();
  await client["stream_echo"]!(1, 2);
  await vi.waitUntil(() => seen.length >= 2);
  await settle();
  expect(seen).toEqual([1, 1]);
  await subscription.close();
});

it("ends a loop over a pipe that is too far behind", async () => {
  const subscription = follow(inTurn(await start()));
  const pipe = subscription.pipe("echo", { limit: 10 });
  const packets = pipe[Symbol.asyncIterator]();
  const client = await subscription.client();
  await vi.waitUntil(() => pipe.isConnected);
  await client["stream_echo"]!(1, 11);
  await settle();
  for (let i = 0; i < 10; ++i) expect((await packets.next()).value).toBe(1);
  expect((await failure(packets.next())).code).toBe(ErrorCode.OutOfSystemResource);
  await subscription.close();
});

it("ends a loop over a pipe whose endpoint was closed because more came at once; the next one goes on", async () => {
  const subscription = follow(inTurn(await start()));
  const connected = vi.spyOn(Core.prototype, "connectPipe");
  const pipe = subscription.pipe<any>("echo", { limit: 10, maxBytes: 1_000_000 });
  const failed: unknown[] = [];
  pipe.onFailed((error) => failed.push((error as RobotRaconteurError).code));
  const seen: unknown[] = [];
  const take = async () => {
    for await (const packet of pipe) seen.push(packet);
  };
  const loop = failure(take());
  const client = await subscription.client();
  await vi.waitUntil(() => pipe.isConnected);
  expect(connected.mock.calls.map(([, , , limits]) => limits)).toEqual([{ limit: 10, maxBytes: 1_000_000 }]);
  connected.mockRestore();
  await client["stream_echo"]!(1, 400);
  const error = await loop;
  expect(error.code).toBe(ErrorCode.OutOfSystemResource);
  expect(error.message).toMatch(/more than 10 (values|packets)/); // the latter of the worker
  expect(seen.length).toBeLessThan(400);
  expect(failed).toEqual([ErrorCode.OutOfSystemResource]);

  seen.length = 0;
  void take();
  await vi.waitUntil(() => clock.waits.length > 0);
  clock.fire();
  await vi.waitUntil(() => pipe.isConnected);
  await client["stream_echo"]!(2, 3);
  await settle();
  expect(seen).toEqual([2, 2, 2]);
  await subscription.close();
});

it("ends a loop over a pipe or an event whose values are too large to wait", async () => {
  const subscription = follow(inTurn(await start()));
  const pipe = subscription.pipe("blocks", { maxBytes: 10_000 });
  const event = subscription.event("filled", { maxBytes: 10_000 });
  const [packets, occurrences] = [pipe[Symbol.asyncIterator](), event[Symbol.asyncIterator]()];
  const client = await subscription.client();
  await vi.waitUntil(() => pipe.isConnected && event.isConnected);
  const block = new Float64Array(1000);
  await client["stream_blocks"]!(block, 2);
  for (let i = 0; i < 2; ++i) await client["fire_filled"]!(block);
  await settle();
  expect((await packets.next()).value).toEqual(block);
  expect((await occurrences.next()).value).toEqual([block]);
  for (const loop of [packets, occurrences]) {
    const error = await failure(loop.next());
    expect(error.code).toBe(ErrorCode.OutOfSystemResource);
    expect(error.message).toContain("10000 bytes");
  }
  await subscription.close();
});

/** A gateway's answer: name, state, type and bases of the one service "test" of each device. */
function answerDevices(...devices: [name: string, state: string, type: string, ...bases: string[]][]): string[] {
  const asked: string[] = [];
  const list = devices.map(([name, state, type, ...bases]) => ({
    name,
    state,
    node_id: "id",
    node_name: null,
    services: [{ name: "test", type, implements: bases }],
  }));
  vi.stubGlobal("fetch", async (url: URL) => {
    asked.push(String(url));
    return new Response(JSON.stringify({ devices: list }));
  });
  return asked;
}
afterEach(() => vi.unstubAllGlobals());

const type = "test.subscribe.Root";

it("finds services of a type among the devices of a gateway", async () => {
  const asked = answerDevices(
    ["a b", "online", type],
    ["other", "online", "test.Other"],
    ["off", "offline", type],
    ["c", "online", type],
  );
  const gateway = "http://gateway:8080/lab";
  const found = await findServices({ gateway, type });
  expect(asked).toEqual(["http://gateway:8080/lab/api/v1/devices"]);
  expect(found.map(({ device }) => device)).toEqual(["a b", "c"]);
  expect(found[0]).toEqual({
    url: "http://gateway:8080/lab/devices/a%20b?service=test",
    device: "a b",
    service: "test",
    type,
    implements: [],
    nodeId: "id",
    nodeName: null,
  });
  expect(await findServices({ gateway: `${gateway}/`, type, filter: ({ device }) => device === "c" })).toEqual([
    found[1],
  ]);
  for (const response of [new Response("no", { status: 404 }), new Response("{}"), new Response("<html>")]) {
    vi.stubGlobal("fetch", async () => response);
    const error = await failure(findServices({ gateway, type }));
    expect([error.code, error.message]).toEqual([ErrorCode.ConnectionError, expect.stringContaining(gateway)]);
  }
  // Refused before anything is asked: nobody would hear what became of that.
  const fetched = vi.fn(() => Promise.reject(new Error("asked")));
  vi.stubGlobal("fetch", fetched);
  const error = await failure(findServices({ gateway, type }, new AbortController() as never));
  expect(error.code).toBe(ErrorCode.InvalidArgument);
  expect(fetched).not.toHaveBeenCalled();
});

it("finds services whose root object implements the type", async () => {
  answerDevices(["newer", "online", "test.subscribe.Newer", "test.Other", type], ["other", "online", "test.Other"]);
  const found = await findServices({ gateway: "http://gateway", type });
  expect(found.map(({ device, type: own, implements: bases }) => [device, own, bases])).toEqual([
    ["newer", "test.subscribe.Newer", ["test.Other", type]],
  ]);
});

it("follows a type: the first device that works, asked for anew after each loss", async () => {
  const first = await start();
  const second = await start();
  const tried: string[] = [];
  const transport: OpenTransport = (to, listener) => {
    tried.push(to.pathname);
    if (to.pathname.endsWith("broken")) throw new Error("refused");
    return (to.pathname.endsWith("a") ? first : second).transport(to, listener);
  };
  answerDevices(["b", "offline", type]);
  const failed: string[] = [];
  const subscription = subscribe({ gateway: "http://gateway", type }, { transport, clock, random: () => 0.5 });
  subscription.onFailed((error, at) => failed.push(`${at} ${(error as RobotRaconteurError).code}`));
  const wire = subscription.wire("both");
  await vi.waitUntil(() => clock.waits.length > 0);
  expect(failed).toEqual([`http://gateway ${ErrorCode.ServiceNotFound}`]);
  answerDevices(["broken", "online", type], ["a", "online", type]);
  clock.fire();
  await subscription.client();
  expect(tried).toEqual(["/devices/broken", "/devices/a"]);
  answerDevices(["b", "online", type]);
  first.drop("gone");
  await vi.waitUntil(() => clock.waits.length > 0);
  clock.fire();
  const client = await subscription.client();
  await vi.waitUntil(() => wire.isConnected);
  await client["publish_both"]!(7);
  await vi.waitUntil(() => wire.value === 7);
  expect(tried.at(-1)).toBe("/devices/b");
  await subscription.close();
});

it("gives up a gateway that does not say what devices it has, and asks again", async () => {
  const service = await start();
  const requests: AbortSignal[] = [];
  vi.stubGlobal("fetch", (_: URL, { signal }: { signal: AbortSignal }) => {
    requests.push(signal);
    return new Promise(() => undefined);
  });
  const failed: unknown[] = [];
  const query = { gateway: "http://gateway", type };
  const subscription = subscribe(query, { transport: service.transport, clock, timeout: 300 });
  subscription.onFailed((error, at) => failed.push([at, (error as Error).message]));
  await vi.waitUntil(() => clock.waits.length > 0);
  expect(failed).toEqual([["http://gateway", "devices of the gateway http://gateway: no answer within 300 ms"]]);
  expect(requests.map(({ aborted }) => aborted)).toEqual([true]);
  answerDevices(["a", "online", type]);
  clock.fire();
  await subscription.client();
  await subscription.close();
  vi.stubGlobal("fetch", () => new Promise(() => undefined));
  const reason = new Error("enough");
  expect(await failure(findServices({ gateway: "http://gateway", type }, AbortSignal.abort(reason)))).toBe(reason);
});
