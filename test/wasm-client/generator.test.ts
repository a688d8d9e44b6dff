// Generator functions: steps in order, and every way to their end.
import { ErrorCode } from "../../wasm-client/dist/node.js";
import { failure, settle, TestService } from "./service.js";
import type { NamedObject } from "./service.js";

const definition = `service test.generator
stdver 0.10
object Root
  property string generator_end
  property varvalue generator_value
  function double{generator} count(double last)
  function varvalue{generator} echo(varvalue{generator} values)
  function void collect(double[]{generator} values)
  function double{generator} refuse()
  function double{generator} hang_on()
end`;

let service: TestService;
let robot: NamedObject;

beforeEach(async () => {
  service = await TestService.start({ definitions: [definition], root: "test.generator.Root" });
  robot = await service.connect();
});
afterEach(async () => {
  vi.useRealTimers();
  await robot.$.close();
});

const ended = () => robot["generator_end"]!.get();

it("gives values to a loop, until there are no more", async () => {
  const seen: unknown[] = [];
  for await (const value of robot["count"]!(3)) seen.push(value);
  expect(seen).toEqual([0, 1, 2]);
  for await (const _ of robot["count"]!(0)) throw new Error("there is none");
  const run = robot["count"]!(1);
  expect(await run.next()).toEqual({ done: false, value: 0 });
  expect(await run.next()).toEqual({ done: true, value: undefined });
  expect(await run.next()).toEqual({ done: true, value: undefined });
  expect(await ended()).toBe("");
});

it("takes values, also with the first step", async () => {
  const run = robot["echo"]!();
  for (const value of ["a", new Map([["b", "c"]])]) expect(await run.next(value)).toEqual({ done: false, value });
  await run.return();
  expect(await ended()).toBe("closed");
  const collecting = robot["collect"]!();
  expect(await collecting.next(new Float64Array([1, 2]))).toEqual({ done: false, value: undefined });
  expect(await robot["generator_value"]!.get()).toEqual(new Float64Array([1, 2]));
  await collecting.return();
});

it("runs several at once, each step after the one before", async () => {
  const first = robot["count"]!(2);
  const second = robot["count"]!(5);
  const steps = await Promise.all([first.next(), second.next(), first.next(), second.next(), first.next()]);
  expect(steps.map(({ value }) => value)).toEqual([0, 0, 1, 1, undefined]);
  expect(steps[4].done).toBe(true);
  await second.return();
});

it("closes with the loop", async () => {
  for await (const value of robot["count"]!(10)) {
    if (value === 2) break;
  }
  expect(await ended()).toBe("closed");
});

it("says nothing to the service before its first step", async () => {
  const before = service.sent.length;
  const run = robot["count"]!(3);
  expect(await run.return()).toEqual({ done: true, value: undefined });
  expect(await run.next()).toEqual({ done: true, value: undefined });
  expect(service.sent.length).toBe(before);
});

it("is aborted by throw()", async () => {
  const run = robot["count"]!(3);
  await run.next();
  expect((await failure(run.throw(new Error("enough")))).message).toBe("enough");
  expect(await ended()).toBe("aborted");
  expect((await run.next()).done).toBe(true);
});

it("ends with what the service raises", async () => {
  expect((await failure(robot["refuse"]!().next())).message).toBe("no");
  const run = robot["count"]!(-1);
  await run.next();
  const error = await failure(run.next());
  expect([error.code, error.message]).toEqual([ErrorCode.OutOfRange, "no more"]);
  expect((await run.next()).done).toBe(true);
  await run.return();
  expect(await ended()).toBe("");
});

it("is aborted where a value does not fit", async () => {
  const run = robot["collect"]!();
  await run.next([1]);
  expect((await failure(run.next("text"))).code).toBe(ErrorCode.DataTypeMismatch);
  await settle();
  expect(await ended()).toBe("aborted");
  expect(() => robot["count"]!()).toThrow("got 0 arguments, expected 1");
});

it("is aborted when a step is given up", async () => {
  const abort = new AbortController();
  const givenUp = failure(robot["hang_on"]!({ signal: abort.signal }).next());
  await settle();
  abort.abort(new Error("enough"));
  expect((await givenUp).message).toBe("enough");
  await settle();
  expect(await ended()).toBe("aborted");

  vi.useFakeTimers();
  const late = failure(robot["hang_on"]!({ timeout: 100 }).next());
  await settle();
  await vi.advanceTimersByTimeAsync(100);
  expect((await late).code).toBe(ErrorCode.RequestTimeout);
});

it("is closed at once, whatever its step waits for", async () => {
  const run = robot["hang_on"]!();
  const waiting = failure(run.next());
  const queued = run.next();
  await settle();
  expect(await run.return()).toEqual({ done: true, value: undefined });
  const error = await waiting;
  expect([error.code, error.message]).toEqual([ErrorCode.OperationAborted, "hang_on: the generator was closed"]);
  expect((await queued).done).toBe(true);
  expect(await ended()).toBe("closed");
});

it("is aborted at once, and its step rejects with the reason", async () => {
  const run = robot["hang_on"]!();
  const waiting = failure(run.next());
  await settle();
  const reason = new Error("enough");
  expect(await failure(run.throw(reason))).toBe(reason);
  expect(await waiting).toBe(reason);
  expect(await ended()).toBe("aborted");
});

it("is not stepped any more where it is closed before the service has said that it is there", async () => {
  const run = robot["hang_on"]!();
  const before = robot.$.stats.messagesSent;
  const waiting = failure(run.next());
  await Promise.resolve(); // asked, and not answered
  await run.return();
  expect((await waiting).code).toBe(ErrorCode.OperationAborted);
  expect(robot.$.stats.messagesSent).toBe(before + 2); // the call of the function, and the end
  expect(await ended()).toBe("closed");
});

it("is closed past whatever waits to be sent", async () => {
  const run = robot["hang_on"]!();
  const waiting = failure(run.next());
  await settle();
  service.buffered = 1_000_000;
  const writing = robot["generator_end"]!.set("written");
  const closing = run.return();
  await settle();
  service.buffered = 0;
  await Promise.all([writing, closing, waiting]);
  expect(await ended()).toBe("written"); // by what came last
});

it("tells who ends it what became of that", async () => {
  const abort = new AbortController();
  const run = robot["hang_on"]!({ signal: abort.signal });
  const givenUp = failure(run.next());
  await settle();
  service.isMute = true;
  abort.abort(new Error("enough"));
  expect((await givenUp).message).toBe("enough");
  const ending = failure(run.return());
  await settle();
  service.drop("gone");
  expect((await ending).subName).toBe("connection_lost"); // nobody knows whether it was aborted
});

it("is aborted where it is given up before the service has said that it is there", async () => {
  const abort = new AbortController();
  const run = robot["hang_on"]!({ signal: abort.signal });
  const givenUp = failure(run.next());
  await Promise.resolve(); // asked, and not answered
  abort.abort(new Error("enough"));
  expect((await givenUp).message).toBe("enough");
  await run.return();
  expect(await ended()).toBe("aborted");
  const before = service.sent.length;
  expect((await failure(robot["hang_on"]!({ signal: abort.signal }).next())).message).toBe("enough");
  expect(service.sent.length).toBe(before);
});

it("ends with its session", async () => {
  const run = robot["hang_on"]!();
  const waiting = failure(run.next());
  await settle();
  service.drop("gone");
  expect((await waiting).subName).toBe("connection_lost");
  expect((await run.return()).done).toBe(true);
});
