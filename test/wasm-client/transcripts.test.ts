// Sessions recorded between a client and a service of the reference (1.2.8), replayed with this client: what it sends
// must be what the reference sent, byte for byte, and it must understand the answers.
import { ErrorCode } from "../../wasm-client/dist/node.js";
import type { ConnectOptions } from "../../wasm-client/dist/node.js";
import { Replay } from "./replay.js";
import { connect, failure, settle } from "./service.js";
import type { NamedObject } from "./service.js";

const withoutTable: ConnectOptions = { stringTable: false };
const version2: ConnectOptions = { version: 2 };

async function replay(name: string, options: ConnectOptions): Promise<{ robot: NamedObject; transcript: Replay }> {
  const transcript = new Replay(name);
  const robot = await connect("ws://127.0.0.1/?service=station", {
    transport: transcript.open,
    nodeName: "transcript.client",
    ...options,
  });
  return { robot, transcript };
}

/** Everything was played, and the client's messages are those of the reference. */
function expectSameBytes(transcript: Replay): void {
  expect(transcript.isOver).toBe(true);
  expect(transcript.found.map((bytes) => bytes.toString("hex"))).toEqual(
    transcript.expected.map((bytes) => bytes.toString("hex")),
  );
}

it.each([
  ["rr+ws-v4-property", withoutTable],
  ["rr+tcp-v4-property", withoutTable],
  ["rr+tcp-v2-property", version2],
])("%s: properties", async (name, options) => {
  const { robot, transcript } = await replay(name, options);
  const m = (member: string) => robot[member]!;
  expect(robot.$.type).toBe("experimental.transcript.station");
  expect(robot.$.node).toEqual({ id: "11111111-2222-3333-4444-555555555555", name: "transcript.service" });
  expect(robot.$.attributes).toEqual(
    new Map<string, unknown>([
      ["place", "bench"],
      ["revision", Int32Array.of(3)],
    ]),
  );
  expect(await m("level").get()).toBe(1.5);
  await m("level").set(-7.25);
  expect(await m("counts").get()).toStrictEqual(Int32Array.of(1, 2, 3));
  await m("counts").set([]);
  await m("counts").set([2147483647, -2147483648]);
  const reading = await m("reading").get<{ label: string }>();
  expect(reading).toStrictEqual({ x: 2.5, label: "first", data: Int32Array.of(4, 5) });
  await m("reading").set({ ...reading, label: "changed" });
  expect(await m("title").get()).toBe("Transcript station – ü");
  await m("secret").set(5);
  expect(await m("status").get()).toBe(7);
  await robot.$.close();
  expectSameBytes(transcript);
});

it.each([
  ["rr+tcp-v4-stringtable-function", {}],
  ["rr+tcp-v2-function", version2],
])("%s: functions, an event, errors", async (name, options: ConnectOptions) => {
  const { robot, transcript } = await replay(name, options);
  const m = (member: string) => robot[member]!;
  const events: unknown[] = [];
  m("changed").on((...args) => events.push(args));
  expect(await m("reset")()).toBeUndefined();
  expect(events).toEqual([[0, "reset"]]);
  expect(await m("add")(1.5, 2.25)).toBe(3.75);
  const custom = await failure(m("fail")("custom"));
  expect({ ...custom, name: custom.name, message: custom.message }).toEqual({
    code: 100,
    name: "experimental.transcript.TranscriptError",
    message: "custom failure",
    subName: "",
    param: null,
  });
  const standard = await failure(m("fail")("standard"));
  expect({ ...standard, name: standard.name, message: standard.message }).toEqual({
    code: ErrorCode.InvalidArgument,
    name: "RobotRaconteur.InvalidArgument",
    message: "bad argument",
    subName: "sub.kind",
    param: new Map<string, unknown>([
      ["limit", Int32Array.of(10)],
      ["name", "x"],
    ]),
  });
  const foreign = await failure(m("fail")("plain"));
  expect([foreign.code, foreign.name, foreign.message]).toEqual([
    ErrorCode.UnknownError,
    "ValueError",
    "plain failure",
  ]);
  await robot.$.close();
  // What a message's own string table holds is free: the reference puts every text there, ours what makes it smaller.
  expect(transcript.isOver).toBe(true);
  expect(transcript.found.length).toBe(transcript.expected.length);
  const bytesOf = (messages: Buffer[]) => messages.reduce((sum, { length }) => sum + length, 0);
  expect(bytesOf(transcript.found)).toBeLessThanOrEqual(bytesOf(transcript.expected));
  if (options.version === 2) expectSameBytes(transcript);
});

it.each([
  ["rr+tcp-v4-objref", withoutTable],
  ["rr+tcp-v2-objref", version2],
])("%s: object references", async (name, options) => {
  const { robot, transcript } = await replay(name, options);
  const m = (member: string) => robot[member]!;
  const head = await m("head").get<NamedObject>();
  expect(await head["size"]!.get()).toBe(4);
  await head["size"]!.set(3);
  expect(await head["identify"]!()).toBe("part head");
  expect(await (await m("parts").get(3))["identify"]!()).toBe("part #3");
  expect(await (await m("parts").get(-1))["identify"]!()).toBe("part #-1");
  expect(await (await m("named").get("a b[1]/.-_%"))["identify"]!()).toBe("part a b[1]/.-_%");
  expect((await failure(m("named").get("none"))).code).toBe(ErrorCode.InvalidArgument);
  expect(await (await m("anything").get<NamedObject>())["identify"]!()).toBe("part any");
  await robot.$.close();
  expectSameBytes(transcript);
});

it("rr+ws-v4-wire: connect, peek, poke, close by the service", async () => {
  const { robot, transcript } = await replay("rr+ws-v4-wire", withoutTable);
  const m = (member: string) => robot[member]!;
  const target = m("target").connect();
  await target.ready;
  await target.send(1.5);
  await settle();
  expect(target.value).toBe(15);
  expect(target.time).toEqual({ seconds: 1795275275, nanoseconds: 25254635 });
  await target.send(2.5);
  await settle();
  expect(target.value).toBe(25);
  await target.close();
  expect(await m("target").peek()).toBe(3.25);
  expect(await m("target").peekOut()).toBe(4.5);
  await m("target").poke(9.75);
  const state = m("state").connect();
  await state.ready;
  await settle();
  expect(state.value).toStrictEqual(Float64Array.of(0.5, 0.25)); // sent before the service agreed to the connection
  await m("fail")("state");
  expect(state.value).toStrictEqual(Float64Array.of(1, 2, 3));
  expect(await m("state").peek()).toStrictEqual(Float64Array.of(1, 2, 3));
  await state.close();
  const again = m("target").connect();
  await again.ready;
  await again.send(-1);
  const rest = [];
  for await (const value of again) rest.push(value); // ends: the service closes it
  expect(rest).toEqual([]);
  await robot.$.close();
  expect(transcript.isOver).toBe(true);
  // Packets carry the time; everything else is determined.
  transcript.found.forEach((bytes, index) => {
    const expected = transcript.expected[index]!;
    expect(bytes.length).toBe(expected.length);
    if (!expected.includes("packettime")) expect(bytes.toString("hex")).toBe(expected.toString("hex"));
  });
});

it("rr+ws-v4-event: events before the answer of the function that caused them", async () => {
  const { robot, transcript } = await replay("rr+ws-v4-event", withoutTable);
  const events: unknown[] = [];
  robot["changed"]!.on((...args) => events.push(args));
  await robot["reset"]!();
  await robot["reset"]!();
  expect(events).toEqual([
    [0, "reset"],
    [0, "reset"],
  ]);
  await robot.$.close();
  expectSameBytes(transcript);
});

it("rr+tcp-v4-stepwise: a service without the combined connect request", async () => {
  const { robot, transcript } = await replay("rr+tcp-v4-stepwise", withoutTable);
  expect(robot.$.attributes.get("place")).toBe("bench");
  expect(await robot["level"]!.get()).toBe(3);
  await robot.$.close();
  expectSameBytes(transcript);
});
