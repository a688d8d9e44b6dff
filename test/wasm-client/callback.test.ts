// Callbacks: the service asks, a handler answers.
import { ErrorCode, RobotRaconteurError } from "../../wasm-client/dist/node.js";
import type { RrValue } from "../../wasm-client/dist/node.js";
import { failure, settle, TestService } from "./service.js";
import type { NamedObject } from "./service.js";

const definition = `service test.callback
stdver 0.10
exception Jammed
object Root
  callback double price(string what, int32 count)
  callback void notice(varvalue what)
  function double ask_price(string what, int32 count)
  function void ask_notice(varvalue what)
  function double twice(double x)
end`;

let service: TestService;
let robot: NamedObject;
const ask = (what = "apple", count = 2) => robot["ask_price"]!(what, count);

beforeEach(async () => {
  service = await TestService.start({ definitions: [definition], root: "test.callback.Root" });
  robot = await service.connect();
});
afterEach(() => robot.$.close());

it("asks the handler, and brings back what it says", async () => {
  const price = robot["price"]!;
  expect(price.handler).toBeNull();
  const asked: RrValue[][] = [];
  const handler = (...args: RrValue[]) => (asked.push(args), 2.5);
  price.handler = handler;
  expect(price.handler).toBe(handler);
  expect(await ask()).toBe(2.5);
  expect(asked).toEqual([["apple", 2]]);
  price.handler = async (_what, count) => await robot["twice"]!(count);
  expect(await ask("pear", 7)).toBe(7);
});

it("answers void callbacks, whatever the handler returns", async () => {
  const seen: RrValue[] = [];
  robot["notice"]!.handler = (what) => void seen.push(what);
  expect(await robot["ask_notice"]!(new Map([["a", "b"]]))).toBeUndefined();
  robot["notice"]!.handler = () => Symbol();
  await robot["ask_notice"]!("more");
  expect(seen).toEqual([new Map([["a", "b"]])]);
});

it("refuses while there is no handler", async () => {
  const error = await failure(ask());
  expect([error.code, error.message]).toEqual([ErrorCode.InvalidOperation, "Callback function not set"]);
  robot["price"]!.handler = () => 1;
  robot["price"]!.handler = null;
  expect((await failure(ask())).code).toBe(ErrorCode.InvalidOperation);
  expect(() => (robot["price"]!.handler = 5 as never)).toThrow("expected a function or null");
});

it("sends errors back", async () => {
  robot["price"]!.handler = () => {
    throw new RobotRaconteurError({ code: 100, name: "test.callback.Jammed", message: "it is stuck", subName: "left" });
  };
  const declared = await failure(ask());
  expect([declared.code, declared.name, declared.message]).toEqual([100, "test.callback.Jammed", "it is stuck"]);
  expect(declared.subName).toBe("left");
  robot["price"]!.handler = async () => Promise.reject(new TypeError("what?"));
  const other = await failure(ask());
  expect([other.code, other.name, other.message]).toEqual([ErrorCode.UnknownError, "TypeError", "what?"]);
  robot["price"]!.handler = () => Promise.reject("text");
  expect((await failure(ask())).message).toBe("text");
});

it("tells both sides of an answer that does not fit", async () => {
  const reported = vi.spyOn(console, "error").mockImplementation(() => undefined);
  robot["price"]!.handler = () => "much";
  const heard = vi.fn();
  const asked = failure(ask()).then((error) => (heard(), error));
  await settle(); // at once, not with the next heartbeat
  expect(heard).toHaveBeenCalledOnce();
  const error = await asked;
  expect(error.code).toBe(ErrorCode.DataTypeMismatch);
  expect((reported.mock.calls[0]![0] as RobotRaconteurError).message).toBe(error.message);
  reported.mockRestore();
  robot["price"]!.handler = () => 3;
  expect(await ask()).toBe(3);
});

it("answers many at once, in any order", async () => {
  const waiting: ((price: number) => void)[] = [];
  robot["price"]!.handler = () => new Promise((resolve) => waiting.push(resolve));
  const first = ask("a", 1);
  const second = ask("b", 2);
  await settle();
  waiting[1]!(20);
  expect(await second).toBe(20);
  waiting[0]!(10);
  expect(await first).toBe(10);
});

it("is quiet when the session ends meanwhile", async () => {
  let answer!: (price: number) => void;
  robot["price"]!.handler = () => new Promise((resolve) => (answer = resolve));
  const asking = failure(ask());
  await settle();
  service.drop("gone");
  expect((await asking).subName).toBe("connection_lost");
  answer(1);
  await settle();
});
