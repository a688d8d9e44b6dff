// Monitors: two clients that take turns at an object. Time is made by hand.
import { ErrorCode } from "../../wasm-client/dist/node.js";
import { failure, settle, TestService } from "./service.js";
import type { NamedObject } from "./service.js";

const definition = `service test.monitor
stdver 0.10
object Root
  property double speed
  function string who()
end`;

let first: NamedObject;
let second: NamedObject;
/** What happened, in order. */
let log: string[];

/** Enters and stays until the returned function is called, which tells how it ended. */
async function hold(robot: NamedObject, name: string): Promise<() => Promise<void>> {
  let leave!: () => void;
  let left!: Promise<void>;
  await new Promise<void>((entered, refused) => {
    left = robot.$.monitor(() => {
      log.push(`${name} enters`);
      entered();
      return new Promise<void>((resolve) => (leave = resolve));
    });
    left.catch(refused);
  });
  return () => {
    log.push(`${name} leaves`);
    leave();
    return left;
  };
}

beforeEach(async () => {
  vi.useFakeTimers({ toFake: ["setTimeout", "clearTimeout", "performance"] });
  log = [];
  const service = await TestService.start({ definitions: [definition], root: "test.monitor.Root" });
  first = await service.connect();
  second = await service.join().connect();
});
afterEach(async () => {
  await Promise.all([first.$.close(), second.$.close()]);
  vi.useRealTimers();
});

it("waits for the one who is in", async () => {
  const leave = await hold(first, "first");
  const turn = second.$.monitor(async () => log.push(`second enters: ${await second["who"]!()}`));
  await settle();
  await leave();
  await turn;
  expect(log).toEqual(["first enters", "first leaves", "second enters: nobody"]);
});

it("keeps others out meanwhile, and only then", async () => {
  const leave = await hold(first, "first");
  expect(await first["who"]!()).toBe("nobody");
  const error = await failure(second["who"]!());
  expect(error.code).toBe(ErrorCode.InvalidOperation);
  expect(error.message).toContain("monitor locked");
  await leave();
  expect(await second["who"]!()).toBe("nobody");
});

it("waits longer than any answer may take", async () => {
  const leave = await hold(first, "first");
  const turn = second.$.monitor(() => log.push("second enters"));
  for (let seconds = 0; seconds < 60; seconds += 10) {
    await vi.advanceTimersByTimeAsync(10_000);
    await first["who"]!(); // one who does nothing for 30 s loses it
  }
  await leave();
  await turn;
  expect(log).toEqual(["first enters", "first leaves", "second enters"]);
});

it("gives up after its timeout, and leaves nothing behind", async () => {
  const leave = await hold(first, "first");
  const waiting = failure(second.$.monitor(() => log.push("second enters"), { timeout: 12_000 }));
  await vi.advanceTimersByTimeAsync(11_900);
  log.push("11.9 s");
  void waiting.then(() => log.push("given up"));
  await first["who"]!();
  await vi.advanceTimersByTimeAsync(5_000);
  expect((await waiting).code).toBe(ErrorCode.OperationTimeout);
  await leave();
  expect(await first.$.monitor(() => "again")).toBe("again");
  expect(await second.$.monitor(() => "now")).toBe("now");
  expect(log).toEqual(["first enters", "11.9 s", "given up", "first leaves"]);
});

it("gives up when it is told to; a turn that comes later is given back", async () => {
  const leave = await hold(first, "first");
  const abort = new AbortController();
  const waiting = failure(second.$.monitor(() => log.push("second enters"), { signal: abort.signal }));
  await settle();
  abort.abort(new Error("enough"));
  expect((await waiting).message).toBe("enough");
  await leave();
  await settle();
  expect(await first.$.monitor(() => "again", { timeout: 1_000 })).toBe("again");
  expect(log).toEqual(["first enters", "first leaves"]);
});

it("gets its turn when the one who is in goes away", async () => {
  const leave = await hold(first, "first");
  const turn = second.$.monitor(() => "mine");
  await first.$.close();
  expect(await turn).toBe("mine");
  expect((await failure(leave())).code).toBe(ErrorCode.ConnectionError);
});

it("gets its turn when the one who is in does nothing for 30 s; that one is told when it leaves", async () => {
  const leave = await hold(first, "first");
  const turn = second.$.monitor(() => "mine");
  await vi.advanceTimersByTimeAsync(31_000);
  expect(await turn).toBe("mine");
  const error = await failure(leave());
  expect(error.code).toBe(ErrorCode.InvalidOperation);
  expect(error.message).toContain("Not monitor locked");
});

it("does not wait for itself", async () => {
  const leave = await hold(first, "first");
  expect((await failure(first.$.monitor(() => 1))).code).toBe(ErrorCode.InvalidOperation);
  await leave();
});
