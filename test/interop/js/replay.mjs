// What rrgate-client gets of a replay, in Node, one message after the other.
//
//   node replay.mjs URL     reads {"messages": [[kind, member], ...]} from standard input, prints {"heard": [[time, value], ...]}
//
// After each step of the replay it waits for the next value of the member that the message is of. `time`: of wires, in ns as text.
import { readFileSync } from "node:fs";
import { connect } from "../../../wasm-client/dist/node.js";

const [url] = process.argv.slice(2);
const { messages } = JSON.parse(readFileSync(0, "utf8"));
const robot = await connect(url);
const replay = await connect(url.replace(/service=.*/, "service=replay"));

/** By member: what has come and was not asked for yet, and who waits for it. */
const queues = new Map();
const queueOf = (member) => {
  if (!queues.has(member)) queues.set(member, { come: [], taken: () => undefined });
  return queues.get(member);
};
const put = (member, time, value) => {
  const queue = queueOf(member);
  queue.come.push([time, value]);
  queue.taken();
};
const next = async (member) => {
  const queue = queueOf(member);
  while (queue.come.length === 0) await new Promise((resolve) => (queue.taken = resolve));
  return queue.come.shift();
};

const follow = async (wire, member) => {
  for await (const value of wire) {
    const { seconds, nanoseconds } = wire.time;
    put(member, String(BigInt(seconds) * 1_000_000_000n + BigInt(nanoseconds)), value);
  }
};
for (const [kind, member] of new Map(messages.map((message) => [message[1], message])).values()) {
  if (kind === "event") robot[member].on((...values) => put(member, null, values));
  if (kind !== "wire") continue;
  const wire = robot[member].connect();
  await wire.ready;
  void follow(wire, member);
}

const plain = (value) => {
  if (ArrayBuffer.isView(value)) return Array.from(value);
  if (Array.isArray(value)) return value.map(plain);
  if (value === null || typeof value !== "object") return value;
  return Object.fromEntries(Object.entries(value).map(([name, field]) => [name, plain(field)]));
};
const heard = [];
for (const [kind, member] of messages) {
  await replay.step(1);
  const [time, value] = kind === "property" ? [null, await robot[member].get()] : await next(member);
  heard.push([time, plain(value)]);
}
console.log(JSON.stringify({ heard }));
await robot.$.close();
await replay.$.close();
