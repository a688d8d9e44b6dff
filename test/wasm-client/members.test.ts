// Members of objects as an application uses them.
import { ErrorCode, RobotRaconteurError } from "../../wasm-client/dist/node.js";
import type { RrValue, WireConnection } from "../../wasm-client/dist/node.js";
import { connect, failure, settle, TestService } from "./service.js";
import type { NamedObject } from "./service.js";

const definition = `service test.members
stdver 0.10
exception Jammed
struct Packet
  field int32 left
  field int32 right
end
object Part
  property string name
  property double size
  objref Part inner
  event touched()
end
object Base
  function double add(double left, double right)
end
object Root
  implements Base
  ## Millimetres.
  property double distance [readonly]
  property double secret [writeonly]
  property double speed
  function double add(double left, double right)
  function void nothing()
  function string join(string first, string second)
  function varvalue echo(varvalue value)
  function void fail(string name, string text)
  function void hang()
  function double{generator} ramp(int32 count)
  function void then(double x)
  function string toString(string text)
  function void constructor(int32 value)
  property double hasOwnProperty
  event bump(int32 side, string text)
  event quiet()
  function void fire_bump(int32 side, string text)
  function void fire_quiet()
  wire Packet packets [readonly]
  wire double both
  wire double target [writeonly]
  function void publish_packets(Packet value)
  function void publish_both(double value)
  objref Part head
  objref Part{int32} parts
  objref Part{string} named
  function void release(string path)
  pipe double stream
  callback double ask(string question)
  memory double[] buffer
end`;

let service: TestService;
let robot: NamedObject;

const start = async () => {
  service = await TestService.start({ definitions: [definition], root: "test.members.Root" });
  robot = await service.connect();
};
beforeEach(start);
afterEach(() => robot.$.close());

/** Member by name; every one of the definition is there. */
const m = (name: string) => robot[name]!;

describe("the object", () => {
  it("tells what it is", () => {
    expect(robot.$.state).toBe("connected");
    expect(robot.$.type).toBe("test.members.Root");
    expect(robot.$.path).toBe("test");
    expect(robot.$.node.name).toBe("test.service");
    expect(robot.$.node.id).toMatch(/^[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}$/);
    expect(robot.$.attributes.get("site")).toBe("dock");
    expect(robot.$.types).toEqual([definition]);
    expect(robot.$.stats.messagesReceived).toBeGreaterThan(1);
    expect(String(Object.prototype.toString.call(robot))).toBe("[object test.members.Root]");
  });

  it("lists its members as the definition declares them", () => {
    expect(robot.$.members.find(({ name }) => name === "distance")).toEqual({
      name: "distance",
      kind: "property",
      type: "double",
      parameters: [],
      modifiers: ["readonly"],
      documentation: "Millimetres.",
    });
    expect(robot.$.members.find(({ name }) => name === "add")).toEqual({
      name: "add",
      kind: "function",
      type: "double",
      modifiers: [],
      documentation: "",
      parameters: [
        { name: "left", type: "double" },
        { name: "right", type: "double" },
      ],
    });
    expect(robot.$.members.find(({ name }) => name === "parts")).toMatchObject({ kind: "objref", type: "Part{int32}" });
    expect(robot.$.members.map(({ name }) => name)).toContain("buffer");
  });

  it("cannot be changed", () => {
    expect(() => ((robot as Record<string, unknown>)["speed"] = 5)).toThrow(TypeError);
    expect(() => (robot.$.members as unknown[]).push as (x: unknown) => void).not.toThrow();
    expect(Object.isFrozen(robot.$.members[0])).toBe(true);
  });

  it("is no promise, whatever its members are called", async () => {
    const before = service.sent.length;
    expect(await robot).toBe(robot);
    expect(`${JSON.stringify(robot)}`).toContain("{");
    await settle();
    expect(service.sent.length).toBe(before); // nothing was called
    expect("then" in robot).toBe(false);
    await robot.$.member("then")(1.5);
    expect(await robot.$.member("toString")("x")).toBe("x");
    await m("constructor")(3);
    await m("hasOwnProperty").set(2);
    expect(await m("hasOwnProperty").get()).toBe(2);
    expect(() => robot.$.member("nope")).toThrow('test.members.Root has no member "nope"');
  });
});

describe("functions", () => {
  it("take arguments by position and return what the service returns", async () => {
    expect(await m("add")(1.5, 2.25)).toBe(1.5);
    expect(await m("nothing")()).toBeUndefined();
    expect(await m("join")("ü", "x")).toBe("ü");
  });

  it("refuse a wrong number of arguments before anything is sent", async () => {
    const before = service.sent.length;
    const few = await failure(m("add")(1));
    expect(few).toBeInstanceOf(RobotRaconteurError);
    expect(few.code).toBe(ErrorCode.InvalidArgument);
    expect(few.message).toBe("add(left, right): got 1 arguments, expected 2");
    expect((await failure(m("add")(1, 2, 3))).message).toBe(
      "add(left, right): the argument behind the last parameter is not {signal, timeout}",
    );
    expect((await failure(m("add")(1, 2, {}, 4))).message).toContain("got 4 arguments");
    expect((await failure(m("add")(1, "x"))).message).toBe("convert 'right': found a string, expected double");
    expect(service.sent.length).toBe(before);
  });

  it("take options behind the arguments, which a struct as last argument is not", async () => {
    expect(await m("add")(1, 2, { timeout: 1000 })).toBe(1);
    expect(await m("echo")({ timeout: "5" })).toEqual(new Map([["timeout", "5"]]));
  });

  it("reject with what the service raised", async () => {
    const error = await failure(m("fail")("test.members.Jammed", "it is stuck"));
    expect(error).toBeInstanceOf(RobotRaconteurError);
    expect({ ...error }).toEqual({ code: 100, subName: "detail", param: Int32Array.of(1, 2) });
    expect(error.name).toBe("test.members.Jammed");
    expect(error.message).toBe("it is stuck");
    expect(String(error)).toBe("test.members.Jammed: it is stuck");
  });

  it("run side by side", async () => {
    expect(await Promise.all(Array.from({ length: 100 }, (_, index) => m("add")(index, 0)))).toEqual(
      Array.from({ length: 100 }, (_, index) => index),
    );
  });
});

describe("properties", () => {
  it("are read and written", async () => {
    await m("speed").set(4.5);
    expect(await m("speed").get()).toBe(4.5);
  });

  it("respect their direction without asking the service", async () => {
    expect((await failure(m("distance").set(1))).code).toBe(ErrorCode.ReadOnlyMember);
    expect((await failure(m("secret").get())).code).toBe(ErrorCode.WriteOnlyMember);
  });
});

describe("events", () => {
  it("reach every listener until it is taken back", async () => {
    const heard: unknown[] = [];
    const off = m("bump").on((...args) => heard.push(["a", ...args]));
    m("bump").on((...args) => heard.push(["b", ...args]));
    await m("fire_bump")(1, "left");
    off();
    off();
    await m("fire_bump")(2, "right");
    expect(heard).toEqual([
      ["a", 1, "left"],
      ["b", 1, "left"],
      ["b", 2, "right"],
    ]);
  });

  it("reach the others when one listener throws", async () => {
    const reported = vi.spyOn(console, "error").mockImplementation(() => undefined);
    const heard: unknown[] = [];
    m("bump").on(() => {
      throw new Error("in the listener");
    });
    m("bump").on((side) => heard.push(side));
    await m("fire_bump")(1, "");
    expect(heard).toEqual([1]);
    expect(reported).toHaveBeenCalledOnce();
    reported.mockRestore();
  });

  it("may call back into the session", async () => {
    const answers: Promise<unknown>[] = [];
    m("bump").on((side) => answers.push(m("add")(side, 0)));
    await m("fire_bump")(7, "");
    expect(await Promise.all(answers)).toEqual([7]);
  });

  it("can be waited for once, with an end", async () => {
    const next = m("bump").once();
    await m("fire_bump")(3, "x");
    expect(await next).toEqual([3, "x"]);
    const abort = new AbortController();
    const givenUp = failure(m("bump").once({ signal: abort.signal }));
    abort.abort(new Error("enough"));
    expect((await givenUp).message).toBe("enough");
    expect((await failure(m("bump").once({ timeout: 5 }))).code).toBe(ErrorCode.RequestTimeout);
    const lost = failure(m("quiet").once());
    service.drop("cable");
    expect((await lost).message).toBe("cable");
  });

  it("end with the object that the service replaces", async () => {
    const head = await m("head").get<NamedObject>();
    const touched = head["touched"]!;
    const loop = (async () => {
      for await (const _ of touched);
    })();
    const ends = [failure(loop), failure(touched.once())];
    await settle();
    await m("release")("test.head");
    ends.push(failure(touched.once()), failure(touched[Symbol.asyncIterator]().next())); // there is none any more
    for (const { message } of await Promise.all(ends))
      expect(message).toBe('the service released object "test.head": look it up again');
  });

  it("fill a loop in order, none missing", async () => {
    const sides: RrValue[] = [];
    const loop = (async () => {
      for await (const [side] of m("bump")) {
        sides.push(side!);
        if (sides.length === 5) break;
      }
    })();
    for (let side = 0; side < 5; ++side) await m("fire_bump")(side, "");
    await loop;
    expect(sides).toEqual([0, 1, 2, 3, 4]);
  });

  it("end a loop that more than 64 MiB wait for with an error", async () => {
    const loop = (m("bump") as unknown as AsyncIterable<unknown>)[Symbol.asyncIterator]();
    const text = "x".repeat(2 ** 21); // 4 MiB here
    for (let side = 0; side < 17; ++side) await m("fire_bump")(side, text);
    for (let side = 0; side < 15; ++side) expect((await loop.next()).value[0]).toBe(side);
    const error = await failure(loop.next());
    expect(error.code).toBe(ErrorCode.OutOfSystemResource);
    expect(error.message).toContain("67108864 bytes of bump");
  });

  it("end a loop with the reason why there will be no more", async () => {
    const loop = (async () => {
      for await (const _ of m("bump"));
    })();
    await settle();
    service.drop("cable");
    expect((await failure(loop)).message).toBe("cable");
  });
});

describe("wires", () => {
  it("give the newest value to a loop, and skip what it was too slow for", async () => {
    const seen: unknown[] = [];
    const wire = m("packets").connect();
    const loop = (async () => {
      for await (const packet of wire) {
        seen.push(packet);
        if (seen.length === 2) break;
        // While the loop is busy, three more come: the newest is what it sees next.
        for (const left of [2, 3, 4]) await m("publish_packets")({ left, right: 0 });
      }
    })();
    await wire.ready;
    await m("publish_packets")({ left: 1, right: 2 });
    await loop;
    expect(seen).toEqual([
      { left: 1, right: 2 },
      { left: 4, right: 0 },
    ]);
    expect(wire.value).toEqual({ left: 4, right: 0 });
    expect(wire.time!.seconds).toBeGreaterThanOrEqual(0);
  });

  it("are closed by leaving the loop", async () => {
    await m("both").poke(5);
    for await (const value of m("both").connect()) {
      expect(value).toBe(5);
      break;
    }
    await settle();
    const before = service.sent.length;
    await m("publish_both")(6);
    expect(service.sent.length).toBe(before + 1);
    const again = m("both").connect();
    await again.ready;
    await settle();
    expect(again.value).toBe(5);
    await again.close();
    await again.close();
  });

  it("share the protocol's one connection", async () => {
    const first = m("both").connect();
    const second = m("both").connect();
    await Promise.all([first.ready, second.ready]);
    await m("publish_both")(1);
    expect([first.value, second.value]).toEqual([1, 1]);
    await first.close();
    await m("publish_both")(2);
    expect([first.value, second.value]).toEqual([1, 2]);
    await second.close();
  });

  it("send, peek and poke", async () => {
    const wire = m("both").connect();
    await wire.send(21);
    await settle();
    expect(await m("both").peek()).toBe(21);
    expect(await m("both").peekOut()).toBe(21);
    await m("both").poke(4);
    expect(await m("both").peek()).toBe(4);
    expect((await failure(wire.send("x"))).message).toBe("convert 'both': found a string, expected double");
    await wire.close();
    expect((await failure(wire.send(1))).message).toBe("wire both is closed");
    expect((await failure(m("packets").poke({ left: 1, right: 1 }))).code).toBe(ErrorCode.ReadOnlyMember);
    expect((await failure(m("target").peek())).code).toBe(ErrorCode.WriteOnlyMember);
  });

  it("end when the session does: with an error when it is lost, quietly when it was closed here", async () => {
    const collect = async (wire: WireConnection) => {
      const seen = [];
      for await (const value of wire) seen.push(value);
      return seen;
    };
    const lost = collect(m("both").connect());
    await settle();
    service.drop("cable");
    expect((await failure(lost)).message).toBe("cable");
    await start();
    const closed = collect(m("both").connect());
    await settle();
    await robot.$.close();
    expect(await closed).toEqual([]);
    expect((await failure(m("both").connect().ready)).code).toBe(ErrorCode.ConnectionError);
  });

  it("can be given up while they connect", async () => {
    const abort = new AbortController();
    const wire = m("both").connect({ signal: abort.signal });
    abort.abort(new Error("enough"));
    expect((await failure(wire.ready)).message).toBe("enough");
    const loop = wire[Symbol.asyncIterator]();
    expect((await failure(loop.next())).message).toBe("enough");
    await m("both").connect().ready; // the next one is not affected
  });

  it("leave a newer connection alone when they are closed before they are ready", async () => {
    void m("both").connect().close();
    const wire = m("both").connect();
    await wire.ready;
    await settle();
    await m("publish_both")(8);
    expect(wire.value).toBe(8);
    await wire.close();
    void m("both").connect().close();
    await m("both").connect().close();
    await settle();
    const last = m("both").connect();
    await last.ready;
    await m("publish_both")(9);
    expect(last.value).toBe(9);
  });
});

describe("object references", () => {
  it("lead to objects, by number, by text and without index", async () => {
    const head = await m("head").get<NamedObject>();
    expect(head.$.path).toBe("test.head");
    expect(head.$.type).toBe("test.members.Part");
    await head["size"]!.set(2);
    expect(await head["size"]!.get()).toBe(2);
    expect(await (await m("parts").get(-5))["name"]!.get()).toBe("parts -5");
    expect(await (await m("named").get("right hand ü."))["name"]!.get()).toBe("named right hand ü.");
    const inner = await head["inner"]!.get<NamedObject>();
    expect((await inner["inner"]!.get<NamedObject>()).$.path).toBe("test.head.inner.inner");
  });

  it("give the same object for the same path", async () => {
    const [one, two] = await Promise.all([m("parts").get(1), m("parts").get(1)]);
    expect(one).toBe(two);
    expect(await m("parts").get(1)).toBe(one);
    expect(await m("parts").get(2)).not.toBe(one);
  });

  it("say why there is no such object", async () => {
    expect((await failure(m("parts").get(99))).code).toBe(ErrorCode.ObjectNotFound);
    expect((await failure(m("named").get("missing"))).message).toContain("no missing");
    expect((await failure(m("parts").get("x"))).message).toBe("parts: expected an int32 as index");
    expect((await failure(m("parts").get())).message).toBe("parts: expected an int32 as index");
    expect((await failure(m("named").get(5))).message).toContain("expected a string as index");
    expect((await failure(m("head").get(5))).message).toBe("head: is one object, it takes no index");
  });

  it("are looked up with limits that are nobody else's", async () => {
    const ended = new AbortController();
    const limited = failure(m("parts").get(3, { signal: ended.signal }));
    const usual: Promise<NamedObject> = m("parts").get(3);
    ended.abort(new Error("enough"));
    expect((await limited).message).toBe("enough");
    expect((await usual).$.path).toBe("test.parts[3]");
    const again = m("parts").get(3, { timeout: 5_000 });
    expect(await again).toBe(await usual);
  });

  it("know when the service has replaced an object that was looked up with limits", async () => {
    const { signal } = new AbortController();
    const head = await m("head").get<NamedObject>({ signal });
    await m("release")("test.head");
    expect(head.$.state).toBe("released");
    const usual = await m("head").get<NamedObject>();
    const limited = await m("head").get<NamedObject>({ timeout: 5_000 });
    await m("release")("test.head");
    expect([usual.$.state, limited.$.state]).toEqual(["released", "released"]);
    expect((await m("head").get<NamedObject>({ signal })).$.state).toBe("connected");
  });

  it("know when the service has replaced an object", async () => {
    const head = await m("head").get<NamedObject>();
    const inner = await head["inner"]!.get<NamedObject>();
    const told: unknown[] = [];
    inner.$.onClose((reason) => told.push(reason?.message));
    await m("release")("test.head");
    expect(head.$.state).toBe("released");
    expect(told).toEqual(['the service released object "test.head.inner": look it up again']);
    expect((await failure(head["size"]!.get())).code).toBe(ErrorCode.ObjectNotFound);
    const again = await m("head").get<NamedObject>();
    expect(again).not.toBe(head);
    expect(await again["size"]!.get()).toBe(0);
    expect(robot.$.state).toBe("connected");
  });
});

it("hears what became of the values of a wire and of a pipe", async () => {
  const wire = robot["both"]!.connect() as WireConnection<number>;
  await wire.ready;
  for (let i = 0; i < 3; ++i) await robot["publish_both"]!(i);
  const losses = await wire.losses();
  expect(losses).toEqual({
    delivered: 3,
    conflated: 0,
    dropped: 0,
    ageP50: expect.any(Number),
    ageP99: expect.any(Number),
  });
  const end = await robot["stream"]!.connect(7);
  await end.send(1);
  expect((await end.losses({ timeout: 1000 }))!.delivered).toBe(1);
  const other = await robot["stream"]!.connect(8);
  expect((await other.losses())!.delivered).toBe(0);
  await wire.close();
  expect(await wire.losses()).toBeUndefined();
  await robot.$.close();
  expect((await failure(end.losses())).code).toBe(ErrorCode.ConnectionError);
});

it.each([Infinity, 2 ** 31])(
  "waits %s ms where it is told to: longer than timers of the engine can",
  async (timeout) => {
    const endpoint = await m("stream").connect(-1);
    service.isMute = true;
    vi.useFakeTimers({ toFake: ["setTimeout", "clearTimeout"] });
    const settled: string[] = [];
    const waits = {
      event: m("bump").once({ timeout }),
      wire: m("both").connect({ timeout }).ready,
      acknowledgement: endpoint.send(1, { ack: true, timeout }),
      answer: m("add")(1, 2, { timeout }),
    };
    for (const [name, wait] of Object.entries(waits)) {
      const over = () => settled.push(name);
      void (wait as Promise<unknown>).then(over, over);
    }
    await vi.advanceTimersByTimeAsync(1000);
    expect(settled).toEqual([]);
    vi.useRealTimers();
    service.isMute = false;
  },
);

it("uses the root object as the type that was asked for", async () => {
  const other = await TestService.start({ definitions: [definition], root: "test.members.Root" });
  const base = await other.connect({ objectType: "test.members.Base" });
  expect(base.$.type).toBe("test.members.Base");
  expect(base.$.members.map(({ name }) => name)).toEqual(["add"]);
  await base.$.close();
  const third = await TestService.start({ definitions: [definition], root: "test.members.Root" });
  expect((await failure(third.connect({ objectType: "test.members.Part" }))).message).toContain("does not implement");
});

it("can be used with types of the application's own", async () => {
  interface Robot {
    add(left: number, right: number): Promise<number>;
  }
  const other = await TestService.start({ definitions: [definition], root: "test.members.Root" });
  const typed = await connect<Robot>("ws://test.example/?service=test", { transport: other.transport });
  const sum: number = await typed.add(1, 2);
  expect(sum).toBe(1);
  await typed.$.close();
});
