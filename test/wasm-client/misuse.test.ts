// Slips of those who call: each is told at once, and disturbs nothing else.
import { ErrorCode } from "../../wasm-client/dist/node.js";
import { platform } from "../../wasm-client/dist/internal.js";
import { connect, failure, subscribe, TestService } from "./service.js";
import type { NamedObject } from "./service.js";

const definition = `service test.misuse
stdver 0.10
object Part
  property double size
end
object Root
  property double speed
  event bumped()
  wire double position
  pipe double packets
  objref Part part
end`;

let service: TestService;
let robot: NamedObject;
beforeEach(async () => {
  service = await TestService.start({ definitions: [definition], root: "test.misuse.Root" });
  robot = await service.connect();
});
afterEach(() => robot.$.close());

const refused = async (what: () => unknown): Promise<string> => {
  const error = await failure((async () => what())());
  expect(error.code).toBe(ErrorCode.InvalidArgument);
  return error.message;
};

it("refuses an AbortController where its signal is meant; the session goes on", async () => {
  const signal = new AbortController() as unknown as AbortSignal;
  const end = (await robot["packets"]!.connect(0)) as unknown as {
    send(value: number, options: object): Promise<void>;
  };
  for (const slip of [
    () => robot["speed"]!.get({ signal }),
    () => robot["bumped"]!.once({ signal }),
    () => robot["position"]!.connect({ signal }),
    () => robot["position"]!.peek({ signal }),
    () => end.send(1, { signal, ack: true }),
    () => robot.$.find("*.part", { signal }),
    () => robot.$.monitor(() => 1, { signal }),
    () => service.connect({ signal }),
    () => subscribe("ws://test.example/?service=test", { signal }),
  ]) {
    expect(await refused(slip), String(slip)).toContain("expected an AbortSignal");
  }
  expect(await robot["speed"]!.get()).toBe(0);
});

it("refuses limits that are none", async () => {
  expect(await refused(() => robot.$.monitor(() => 1, { timeout: -1 }))).toBe(
    "timeout -1: expected milliseconds above 0",
  );
  expect(await refused(() => service.connect({ requestTimeout: 0 }))).toBe(
    "requestTimeout 0: expected milliseconds above 0",
  );
});

it("refuses what is no function", async () => {
  expect(await refused(() => robot["bumped"]!.on(undefined as never))).toBe(
    "bumped.on: found undefined, expected a function",
  );
  expect(await refused(() => robot.$.monitor("x" as never))).toBe("monitor: found string, expected a function");
});

it("does not connect without a name where there is a password", async () => {
  for (const options of [{ password: "secret" }, { credentials: { password: "secret" } }]) {
    expect(await refused(() => service.connect(options))).toContain("without username");
  }
});

it("finds no object once the session is closed, not even a known one", async () => {
  await robot["part"]!.get();
  await robot.$.close();
  for (const look of [robot["part"]!.get(), robot.$.find("*.part"), robot.$.find("*")]) {
    expect((await failure(look as Promise<unknown>)).code).toBe(ErrorCode.ConnectionError);
  }
});

it("says what a URL looks like", async () => {
  expect(await refused(() => connect("127.0.0.1:8080/?service=x"))).toContain("expected the like of ws://host:8080/");
});

it("says why the core could not be loaded, in a class of its own, and tries again", async () => {
  vi.resetModules(); // so that nothing is loaded yet
  const fresh = await import("../../wasm-client/dist/node.js");
  const own = (await import("../../wasm-client/dist/internal.js")) as { platform: typeof platform };
  const { loadWasm } = own.platform;
  own.platform.loadWasm = () => Promise.reject(new Error("404 Not Found"));
  const attempt = () => fresh.connect("ws://test.example/?service=test", { transport: service.transport });
  const error = await failure(attempt());
  expect(error).toBeInstanceOf(fresh.RobotRaconteurError);
  expect(error.message).toBe("the protocol core could not be loaded: 404 Not Found");
  own.platform.loadWasm = loadWasm;
  await robot.$.close();
  const again = await TestService.start({ definitions: [definition], root: "test.misuse.Root" });
  const root = await fresh.connect("ws://test.example/?service=test", { transport: again.transport });
  await root.$.close();
});

it("rejects in the same class where the engine refuses the WebSocket", async () => {
  const { findWebsocket } = platform;
  platform.findWebsocket = () =>
    Promise.resolve(
      class {
        constructor() {
          throw new DOMException("An insecure WebSocket may not be opened from an encrypted page", "SecurityError");
        }
      } as unknown as typeof WebSocket,
    );
  try {
    const error = await failure(connect("ws://test.example/?service=test"));
    expect(error.code).toBe(ErrorCode.ConnectionError);
    expect(error.message).toContain("could not connect to ws://test.example/: An insecure WebSocket");
  } finally {
    platform.findWebsocket = findWebsocket;
  }
});
