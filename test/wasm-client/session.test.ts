// The life of a session: how it begins, what ends it, and what becomes of what waits. Time is simulated.
import { ErrorCode, RobotRaconteurError } from "../../wasm-client/dist/node.js";
import type { OpenTransport, TransportListener } from "../../wasm-client/dist/node.js";
import { connect, failure, settle, TestService } from "./service.js";

const definition = `service test.session
stdver 0.10
object Root
  property double speed
  property string text
  wire double both
  event bump()
  function double twice(double x)
  function void fire_bump()
  function void hang()
  function void stop()
end`;

let service: TestService;
const start = async () => {
  service = await TestService.start({ definitions: [definition], root: "test.session.Root" });
  return service.connect();
};

afterEach(() => {
  vi.useRealTimers();
});

/** A transport in the hands of the test. */
function manual(): {
  open: OpenTransport;
  listener: TransportListener;
  sent: Uint8Array[];
  closed: number;
  buffered: number;
} {
  const state = {
    listener: undefined as unknown as TransportListener,
    sent: [] as Uint8Array[],
    closed: 0,
    buffered: 0,
  };
  const open: OpenTransport = (_url, listener) => {
    state.listener = listener;
    return {
      send: (bytes: Uint8Array) => void state.sent.push(bytes.slice()),
      get buffered() {
        return state.buffered;
      },
      close: () => void ++state.closed,
    };
  };
  return Object.assign(state, { open });
}

describe("connecting", () => {
  it("fails with the transport's reason", async () => {
    const transport = manual();
    const connecting = failure(connect("ws://test/?service=test", { transport: transport.open }));
    await settle();
    transport.listener.closed("could not connect to ws://test/: refused");
    const error = await connecting;
    expect(error).toBeInstanceOf(RobotRaconteurError);
    expect(error.code).toBe(ErrorCode.ConnectionError);
    expect(error.message).toBe("could not connect to ws://test/: refused");
  });

  it("fails with the reason of a stream that breaks during the handshake", async () => {
    const transport = manual();
    const connecting = failure(connect("ws://test/?service=test", { transport: transport.open }));
    await settle();
    transport.listener.opened();
    await vi.waitUntil(() => transport.sent.length > 0);
    transport.listener.closed("the connection to ws://test/ was closed: device offline: create");
    const error = await connecting;
    expect(error.code).toBe(ErrorCode.ConnectionError);
    expect(error.message).toContain("device offline: create");
    expect(transport.closed).toBe(1);
  });

  it("fails where the bytes are not Robot Raconteur", async () => {
    const transport = manual();
    const connecting = failure(connect("ws://test/?service=test", { transport: transport.open }));
    await settle();
    transport.listener.opened();
    transport.listener.received(new TextEncoder().encode("HTTP/1.1 400 Bad Request\r\n\r\n"));
    expect((await connecting).code).toBe(ErrorCode.ProtocolError);
    expect(transport.closed).toBe(1);
  });

  it("passes on what the service says", async () => {
    const other = await TestService.start({ definitions: [definition], root: "test.session.Root" });
    const error = await failure(connect("ws://test/?service=nope", { transport: other.transport }));
    expect(error.code).toBe(ErrorCode.ServiceNotFound);
    expect(error.message).toContain("nope");
    expect(other.isClosed).toBe(true);
  });

  it("ends after its timeout, whatever it waits for", async () => {
    vi.useFakeTimers();
    const silent = manual();
    const opening = failure(connect("ws://test/?service=test", { transport: silent.open, timeout: 3_000 }));
    await vi.advanceTimersByTimeAsync(2_999);
    expect(silent.closed).toBe(0);
    await vi.advanceTimersByTimeAsync(1);
    expect((await opening).message).toBe("test: no session within 3000 ms");
    expect((await opening).code).toBe(ErrorCode.RequestTimeout);
    expect(silent.closed).toBe(1);
  });

  it("ends when its signal says so", async () => {
    expect(
      (await failure(connect("ws://test/?service=test", { signal: AbortSignal.abort(new Error("early")) }))).message,
    ).toBe("early");
    const abort = new AbortController();
    const transport = manual();
    const connecting = failure(connect("ws://test/?service=test", { transport: transport.open, signal: abort.signal }));
    await settle();
    abort.abort();
    expect((await connecting).name).toBe("AbortError");
    await settle();
    expect(transport.closed).toBe(1);
    transport.listener.opened();
    transport.listener.closed("late news changes nothing");
    await settle();
  });

  it("closes a transport that opens after the end", async () => {
    let give!: (transport: ReturnType<OpenTransport>) => void;
    const slow: OpenTransport = () => new Promise((resolve) => (give = resolve as typeof give));
    const abort = new AbortController();
    const connecting = failure(connect("ws://test/?service=test", { transport: slow, signal: abort.signal }));
    await settle();
    abort.abort(new Error("enough"));
    expect((await connecting).message).toBe("enough");
    let closed = 0;
    give({ send: () => undefined, buffered: 0, close: () => void ++closed });
    await settle();
    expect(closed).toBe(1);
  });

  it("refuses options that make no sense", async () => {
    const transport = manual();
    for (const [options, message] of [
      [{ timeout: 0 }, "timeout 0"],
      [{ timeout: NaN }, "timeout NaN"],
      [{ maxMessageSize: 10 }, "'maxMessageSize'"],
      [{ version: 3 as never }, "'version'"],
      [{ credentials: { x: Symbol() }, username: "u" }, "credentials"],
    ] as const) {
      const connecting = failure(connect("ws://test/?service=test", { transport: transport.open, ...options }));
      await settle();
      transport.listener?.opened();
      const error = await connecting;
      expect(error.message).toContain(message);
      expect(error).toBeInstanceOf(RobotRaconteurError);
    }
    const open: OpenTransport = (_url, listener) => {
      queueMicrotask(() => listener.opened());
      return { send: () => undefined, buffered: 0, close: () => undefined };
    };
    const error = await failure(connect("ws://test/?service=test&nodeid=xyz", { transport: open }));
    expect(error.message).toContain("'nodeId'");
  });
});

describe("requests", () => {
  it("end after their timeout; the session lives on", async () => {
    const robot = await start();
    vi.useFakeTimers();
    const short = failure(robot["hang"]!({ timeout: 200 }));
    const usual = failure(robot["hang"]!());
    await vi.advanceTimersByTimeAsync(200);
    const error = await short;
    expect(error.code).toBe(ErrorCode.RequestTimeout);
    expect(error.name).toBe("RobotRaconteur.RequestTimeout");
    expect(error.message).toContain("hang");
    await vi.advanceTimersByTimeAsync(14_800);
    expect((await usual).code).toBe(ErrorCode.RequestTimeout);
    vi.useRealTimers();
    expect(await robot["twice"]!(4)).toBe(4);
    await robot.$.close();
  });

  it("may take longer than usual", async () => {
    const robot = await start();
    vi.useFakeTimers();
    let isOver = false;
    const long = failure(robot["hang"]!({ timeout: 60_000 })).then((error) => ((isOver = true), error));
    // Heartbeats keep the session alive meanwhile.
    for (let second = 0; second < 59; ++second) await vi.advanceTimersByTimeAsync(1_000);
    expect(isOver).toBe(false);
    await vi.advanceTimersByTimeAsync(1_500);
    expect((await long).code).toBe(ErrorCode.RequestTimeout);
    vi.useRealTimers();
    await robot.$.close();
  });

  it("are given up by their signal", async () => {
    const robot = await start();
    const abort = new AbortController();
    const hanging = failure(robot["hang"]!({ signal: abort.signal }));
    abort.abort(new Error("enough"));
    expect((await hanging).message).toBe("enough");
    const before = service.sent.length;
    expect((await failure(robot["twice"]!(1, { signal: abort.signal }))).message).toBe("enough");
    expect(service.sent.length).toBe(before);
    expect(await robot["twice"]!(2)).toBe(2);
    await robot.$.close();
  });

  it("leave nothing behind on a signal that many share", async () => {
    const robot = await start();
    const { signal } = new AbortController();
    const add = vi.spyOn(signal, "addEventListener");
    const remove = vi.spyOn(signal, "removeEventListener");
    for (let i = 0; i < 10; ++i) await robot["twice"]!(i, { signal });
    expect(remove).toHaveBeenCalledTimes(add.mock.calls.length);
    await robot.$.close();
  });
});

describe("the end of a session", () => {
  it("by close() rejects what waits, tells the service and resolves; again it does nothing", async () => {
    const robot = await start();
    const hanging = failure(robot["hang"]!());
    const told: unknown[] = [];
    robot.$.onClose((...reason) => told.push(reason));
    await settle();
    const before = service.sent.length;
    const closing = robot.$.close();
    expect(robot.$.close()).toBe(closing);
    expect((await hanging).message).toBe("the session was closed by this side");
    await closing;
    expect(service.sent.length).toBe(before + 1); // DisconnectClient
    expect(service.isClosed).toBe(true);
    expect(told).toEqual([[]]);
    expect(robot.$.state).toBe("closed");
    const late = await failure(robot["twice"]!(1));
    expect(late.code).toBe(ErrorCode.ConnectionError);
    expect((await failure(robot["speed"]!.get())).code).toBe(ErrorCode.ConnectionError);
    // What was known stays readable.
    expect(robot.$.stats.messagesSent).toBeGreaterThanOrEqual(0);
    expect(robot.$.members.length).toBe(8);
  });

  it("by close() does not wait for a service that does not answer", async () => {
    const robot = await start();
    service.buffered = 10_000_000; // nothing gets out any more
    vi.useFakeTimers();
    let isClosed = false;
    const closing = robot.$.close().then(() => (isClosed = true));
    await vi.advanceTimersByTimeAsync(400);
    expect(isClosed).toBe(false);
    await vi.advanceTimersByTimeAsync(200);
    await closing;
  });

  it("by a broken stream rejects with the reason, once", async () => {
    const robot = await start();
    const told: unknown[] = [];
    const off = robot.$.onClose(() => told.push("taken back"));
    off();
    robot.$.onClose((reason) => told.push(reason?.message));
    robot.$.onClose(() => {
      throw new Error("in the listener");
    });
    robot.$.onClose((reason) => told.push(reason?.code));
    const reported = vi.spyOn(console, "error").mockImplementation(() => undefined);
    const hanging = failure(robot["hang"]!());
    service.drop("the connection to ws://test/ was closed: device offline: create");
    service.drop("again");
    expect((await hanging).message).toContain("device offline: create");
    expect(told).toEqual([
      "the connection to ws://test/ was closed: device offline: create",
      ErrorCode.ConnectionError,
    ]);
    expect(reported).toHaveBeenCalledOnce();
    reported.mockRestore();
    expect((await failure(robot["twice"]!(1))).message).toContain("device offline: create");
    const late: unknown[] = [];
    robot.$.onClose((reason) => late.push(reason?.code));
    await settle();
    expect(late).toEqual([ErrorCode.ConnectionError]);
    await robot.$.close();
  });

  it("by the service says so", async () => {
    const robot = await start();
    const error = await failure(robot["stop"]!());
    expect(error.code).toBe(ErrorCode.ConnectionError);
    expect(robot.$.state).toBe("closed");
    expect(service.isClosed).toBe(true);
  });

  it("by garbage in the stream closes the transport", async () => {
    const robot = await start();
    let reason: RobotRaconteurError | undefined;
    robot.$.onClose((why) => (reason = why));
    service.garbage(new TextEncoder().encode("garbage that is long enough to be looked at"));
    await settle();
    expect(reason?.code).toBe(ErrorCode.ProtocolError);
    expect(service.isClosed).toBe(true);
  });

  it("by silence comes after the heartbeat has stayed unanswered", async () => {
    vi.useFakeTimers({ toFake: ["setTimeout", "clearTimeout", "performance", "Date"] });
    const robot = await start();
    let reason: RobotRaconteurError | undefined;
    robot.$.onClose((why) => (reason = why));
    service.isMute = true;
    for (let second = 0; second < 9; ++second) await vi.advanceTimersByTimeAsync(1_000);
    expect(reason).toBeUndefined();
    for (let second = 0; second < 20; ++second) await vi.advanceTimersByTimeAsync(1_000);
    expect(reason?.code).toBe(ErrorCode.ConnectionError);
    expect(robot.$.state).toBe("closed");
  });

  it("leaves no timer running", async () => {
    vi.useFakeTimers({ toFake: ["setTimeout", "clearTimeout", "performance", "Date"] });
    const robot = await start();
    await robot.$.close();
    expect(vi.getTimerCount()).toBe(0);
  });

  it("of one does not touch another", async () => {
    const one = await start();
    const two = await start();
    await one.$.close();
    expect(await two["twice"]!(3)).toBe(3);
    await two.$.close();
  });
});

describe("a slow network", () => {
  it("holds back what is to be sent and replaces wire values by newer ones", async () => {
    const robot = await start();
    const wire = robot["both"]!.connect();
    await wire.ready;
    service.buffered = 1_000_000;
    await robot["text"]!.set("x".repeat(100_000), { timeout: 1 }).catch(() => undefined);
    const before = service.sent.length;
    for (let value = 1; value <= 50; ++value) await wire.send(value);
    expect(service.sent.length).toBe(before);
    service.buffered = 0;
    await vi.waitUntil(() => service.sent.length > before);
    await vi.waitUntil(async () => (await robot["both"]!.peek()) === 50);
    const values = service.sent.length - before;
    expect(values).toBeLessThan(30);
    await robot.$.close();
  });

  it("gets frames of at most 65,535 bytes", async () => {
    const robot = await start();
    await robot["text"]!.set("x".repeat(1_000_000));
    expect(Math.max(...service.sent.map(({ length }) => length))).toBe(65_535);
    expect(((await robot["text"]!.get()) as unknown as string).length).toBe(1_000_000);
    await robot.$.close();
  });

  it("of a message above the limit ends with an error that says so; the session lives on", async () => {
    const robot = await start();
    const error = await failure(robot["text"]!.set("x".repeat(13 * 1024 * 1024)));
    expect(error.code).toBe(ErrorCode.BufferLimitViolation);
    expect(await robot["twice"]!(1)).toBe(1);
    await robot.$.close();
  });
});
