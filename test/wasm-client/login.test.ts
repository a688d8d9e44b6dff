// Users and locks.
import { ErrorCode } from "../../wasm-client/dist/node.js";
import type { ConnectOptions } from "../../wasm-client/dist/node.js";
import { failure, settle, TestService } from "./service.js";
import type { NamedObject } from "./service.js";

const definition = `service test.login
stdver 0.10
object Part
  property double size
end
object Root
  property double speed
  objref Part part
  function string who()
end`;

let robot: NamedObject;
const start = async (requireUser: boolean, options: ConnectOptions = {}) => {
  const service = await TestService.start({ definitions: [definition], root: "test.login.Root", requireUser });
  return (robot = await service.connect(options));
};
afterEach(() => robot.$.close());

it("logs in while it connects", async () => {
  await start(true, { username: "alice", password: "secret" });
  expect(await robot["who"]!()).toBe("alice");
  await robot.$.close();
  await start(true, { username: "bob", credentials: { password: "secret" } });
  expect(await robot["who"]!()).toBe("bob");
});

it("rejects a wrong login, and none where one is needed", async () => {
  expect((await failure(start(true, { username: "alice", password: "guess" }))).code).toBe(
    ErrorCode.AuthenticationError,
  );
  const service = await TestService.start({ definitions: [definition], root: "test.login.Root", requireUser: true });
  expect((await failure(service.connect())).code).toBe(ErrorCode.AuthenticationError);
});

it("logs in and out later", async () => {
  await start(false);
  expect(await robot["who"]!()).toBe("nobody");
  await robot.$.login("alice", "secret");
  expect(await robot["who"]!()).toBe("alice");
  await robot.$.login("bob", new Map([["password", "secret"]]));
  expect(await robot["who"]!()).toBe("bob");
  const error = await failure(robot.$.login("bob", { password: "guess" }));
  expect(error.code).toBe(ErrorCode.AuthenticationError);
  expect(await robot["who"]!()).toBe("bob");
  await robot.$.logout();
  expect(await robot["who"]!()).toBe("nobody");
  expect((await failure(robot.$.login("bob", Symbol() as never))).code).toBe(ErrorCode.DataTypeMismatch);
});

it("locks an object, where a user has logged in", async () => {
  await start(false);
  expect((await failure(robot.$.lock())).code).toBe(ErrorCode.AuthenticationError);
  await robot.$.login("alice", "secret");
  await robot.$.lock();
  expect((await failure(robot.$.lock("client"))).code).toBe(ErrorCode.ObjectLockedError);
  await robot.$.unlock();
  const part = (await robot["part"]!.get()) as unknown as NamedObject;
  await part.$.lock("client");
  await part.$.unlock();
  expect((await failure(robot.$.lock("mine" as never))).message).toContain('found "mine"');
});

it("runs a function while it has the monitor", async () => {
  await start(false);
  expect(await robot.$.monitor(() => robot["who"]!())).toBe("nobody");
  const error = await failure(robot.$.monitor(() => Promise.reject(new Error("it went wrong")), { timeout: 1_000 }));
  expect(error.message).toBe("it went wrong");
  expect(await robot.$.monitor(() => 1)).toBe(1);
});

it("does not keep a monitor that it gave up", async () => {
  await start(false);
  const abort = new AbortController();
  const entering = failure(robot.$.monitor(() => 1, { signal: abort.signal }));
  abort.abort(new Error("enough"));
  expect((await entering).message).toBe("enough");
  await settle();
  expect(await robot.$.monitor(() => 2, { timeout: 1_000 })).toBe(2);
});
