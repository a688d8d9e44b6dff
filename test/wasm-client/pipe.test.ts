// Pipes: packets in order, none lost, and what ends an endpoint.
import { ErrorCode } from "../../wasm-client/dist/node.js";
import type { PipeEndpoint, RrValue } from "../../wasm-client/dist/node.js";
import { failure, settle, TestService } from "./service.js";
import type { NamedObject } from "./service.js";

const definition = `service test.pipe
stdver 0.10
object Part
  pipe double echo
end
object Root
  pipe double echo
  pipe double[] blocks
  pipe varvalue any
  pipe string greeting
  pipe double refused
  pipe double mute
  pipe double shown [readonly]
  objref Part part
  function void stream_echo(double value, int32 count)
  function void stream_blocks(double[] value, int32 count)
  function void close_echo()
  function void hang()
end`;

let service: TestService;
let robot: NamedObject;
const open = (pipe: string, ...args: [number?]): Promise<PipeEndpoint> => robot[pipe]!.connect(args[0] ?? -1);

/** The next packets. */
async function take(endpoint: PipeEndpoint, count: number): Promise<RrValue[]> {
  const packets = endpoint[Symbol.asyncIterator]();
  const taken: RrValue[] = [];
  while (taken.length < count) {
    const next = await packets.next();
    if (next.done) break;
    taken.push(next.value);
  }
  return taken;
}

beforeEach(async () => {
  service = await TestService.start({ definitions: [definition], root: "test.pipe.Root" });
  robot = await service.connect();
});
afterEach(() => robot.$.close());

it("carries packets both ways, in order", async () => {
  const endpoint = await robot["echo"]!.connect();
  expect(endpoint.index).toBe(1);
  for (let i = 0; i < 100; ++i) await endpoint.send(i);
  expect(await take(endpoint, 100)).toEqual(Array.from({ length: 100 }, (_, i) => i));
  await endpoint.close();
  expect(endpoint.isClosed).toBe(true);
});

it("knows its endpoints by index, as the service gives them", async () => {
  const first = await open("echo");
  const fifth = await open("echo", 5);
  const sixth = await open("echo", 3);
  expect([first.index, fifth.index, sixth.index]).toEqual([1, 5, 6]);
  await sixth.send(6);
  await first.send(1);
  expect(await take(first, 1)).toEqual([1]);
  expect(await take(sixth, 1)).toEqual([6]);
  await Promise.all([first.close(), sixth.close()]);
  await fifth.send(5);
  expect(await take(fifth, 1)).toEqual([5]);
  expect((await failure(open("echo", 1.5))).code).toBe(ErrorCode.InvalidArgument);
});

it("keeps packets that come while it connects", async () => {
  const endpoint = await open("greeting");
  expect(await take(endpoint, 2)).toEqual(["hello", "world"]);
});

it("brings varvalues with their types", async () => {
  const endpoint = await open("any");
  await endpoint.send(new Map([["a", "b"]]));
  expect(await take(endpoint, 1)).toEqual([new Map([["a", "b"]])]);
});

it("waits for the network where much is on its way", async () => {
  const endpoint = await open("blocks");
  service.isMute = true;
  service.buffered = 1e9;
  const block = new Float64Array(1000);
  let isTaken = false;
  const sending = endpoint.send(block).then(() => (isTaken = true));
  await settle();
  expect(isTaken).toBe(false);
  service.buffered = 0;
  await sending;
  // Who does not wait is stopped before the memory is full.
  service.buffered = 1e9;
  const large = new Float64Array(1_000_000);
  const results = Array.from({ length: 8 }, () => endpoint.send(large));
  const outcomes = Promise.allSettled(results);
  await settle();
  service.drop("gone");
  const rejected = (await outcomes).map((outcome) => (outcome as PromiseRejectedResult).reason.code as number);
  expect(rejected.slice(0, 4)).toEqual(Array.from({ length: 4 }, () => ErrorCode.ConnectionError));
  expect(rejected.at(-1)).toBe(ErrorCode.OutOfSystemResource);
});

it("waits for acknowledgements where they are wanted", async () => {
  const endpoint = await open("echo");
  await endpoint.send(1, { ack: true });
  await Promise.all([endpoint.send(2, { ack: true }), endpoint.send(3, { ack: true })]);
  service.isMute = true;
  const abort = new AbortController();
  const aborted = failure(endpoint.send(4, { ack: true, signal: abort.signal }));
  await settle();
  abort.abort(new Error("enough"));
  expect((await aborted).message).toBe("enough");
  vi.useFakeTimers();
  const late = failure(endpoint.send(5, { ack: true, timeout: 100 }));
  await settle();
  await vi.advanceTimersByTimeAsync(100);
  expect((await late).code).toBe(ErrorCode.RequestTimeout);
  vi.useRealTimers();
  const openOnes = failure(endpoint.send(6, { ack: true }));
  await settle();
  service.isMute = false;
  void endpoint.close();
  expect((await openOnes).code).toBe(ErrorCode.InvalidOperation);
});

it("waits for nothing any more where an acknowledgement does not come in time", async () => {
  const endpoint = await open("echo");
  service.isMute = true;
  const added = vi.spyOn(AbortSignal.prototype, "addEventListener");
  const removed = vi.spyOn(AbortSignal.prototype, "removeEventListener");
  vi.useFakeTimers();
  const late = failure(endpoint.send(1, { ack: true, timeout: 100 }));
  await settle();
  await vi.advanceTimersByTimeAsync(100);
  expect((await late).code).toBe(ErrorCode.RequestTimeout);
  vi.useRealTimers();
  await settle();
  expect(added.mock.calls.length).toBeGreaterThan(0);
  expect(removed).toHaveBeenCalledTimes(added.mock.calls.length);
  vi.restoreAllMocks();
});

it("refuses what is not a packet of the pipe", async () => {
  const endpoint = await open("echo");
  expect((await failure(endpoint.send("text"))).code).toBe(ErrorCode.DataTypeMismatch);
  expect((await failure((await open("shown")).send(1))).code).toBe(ErrorCode.ReadOnlyMember);
  await endpoint.send(7);
  expect(await take(endpoint, 1)).toEqual([7]);
});

it("rejects where the service refuses, or never answers", async () => {
  const error = await failure(open("refused"));
  expect([error.code, error.message]).toEqual([ErrorCode.OperationFailed, "no"]);
  const abort = new AbortController();
  const mute = failure(robot["mute"]!.connect(-1, { signal: abort.signal }));
  await settle();
  abort.abort(new Error("enough"));
  expect((await mute).message).toBe("enough");
});

it("ends a loop when the service closes the endpoint; what came before is still there", async () => {
  const endpoint = await open("echo");
  const closed: unknown[] = [];
  endpoint.onClose((reason) => closed.push(reason));
  await robot["stream_echo"]!(3, 2);
  await robot["close_echo"]!();
  await settle();
  expect(closed).toEqual([undefined]);
  expect(endpoint.isClosed).toBe(true);
  const packets: RrValue[] = [];
  for await (const packet of endpoint) packets.push(packet);
  expect(packets).toEqual([3, 3]);
  expect((await failure(endpoint.send(1))).code).toBe(ErrorCode.InvalidOperation);
  await endpoint.close();
  expect((await open("echo")).index).toBe(2); // what was on its way to the one before reaches no other
});

it("closes with the loop over it", async () => {
  const endpoint = await open("echo");
  await endpoint.send(1);
  for await (const packet of endpoint) {
    expect(packet).toBe(1);
    break;
  }
  expect(endpoint.isClosed).toBe(true);
  await settle();
  expect((await open("echo", 1)).index).toBe(1); // the service has closed it, too
});

it("closes with an error where the loop is too far behind", async () => {
  const endpoint = await robot["echo"]!.connect(-1, { limit: 10 });
  await robot["stream_echo"]!(1, 11);
  await settle();
  expect(endpoint.isClosed).toBe(true);
  expect(await take(endpoint, 10)).toHaveLength(10);
  const error = await failure(take(endpoint, 1));
  expect(error.code).toBe(ErrorCode.OutOfSystemResource);
  expect(error.message).toContain("more than 10 values");

  const heavy = await robot["blocks"]!.connect(-1, { maxBytes: 10_000 });
  await robot["stream_blocks"]!(new Float64Array(1000), 2);
  await settle();
  expect(await take(heavy, 1)).toHaveLength(1);
  expect((await failure(take(heavy, 1))).message).toContain("10000 bytes");
});

it("ends with its session", async () => {
  const endpoint = await open("echo");
  const closed: unknown[] = [];
  endpoint.onClose((reason) => closed.push(reason));
  const waiting = failure(take(endpoint, 1));
  service.drop("the cable is out");
  expect((await waiting).message).toContain("the cable is out");
  expect(closed).toHaveLength(1);
  expect((await failure(endpoint.send(1))).code).toBe(ErrorCode.InvalidOperation);
  await endpoint.close();
});

it("ends without error when the session is closed here", async () => {
  const endpoint = await open("echo");
  const waiting = take(endpoint, 1);
  await robot.$.close();
  expect(await waiting).toEqual([]);
});

it("ends with its object", async () => {
  const part = await robot["part"]!.get(undefined);
  const endpoint = await (part as unknown as NamedObject)["echo"]!.connect(-1);
  service.release("test.part");
  await settle();
  expect(endpoint.isClosed).toBe(true);
});
