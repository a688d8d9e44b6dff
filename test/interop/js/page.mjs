// The test service by rrgate-client/serve: a page, but for Node in its place, that is device "interop" of a gateway.
//
//   node page.mjs URL NAME [OPTIONS]     prints {"served", "reason"} whenever the gateway at URL has it, or has it no more; ends
//                                        with standard input. Where the gateway refuses it: {"error"}
import { readFileSync } from "node:fs";
import { serve } from "../../../wasm-client/dist/serve/node.js";
import { RobotRaconteurError } from "../../../wasm-client/dist/node.js";

const definition = readFileSync(new URL("../experimental.interop.robdef", import.meta.url), "utf8");
const errors = { operation_failed: 19, invalid_argument: 18, out_of_range: 29, not_implemented: 104 };
const names = {
  operation_failed: "OperationFailed",
  invalid_argument: "InvalidArgument",
  out_of_range: "OutOfRange",
  not_implemented: "NotImplementedError",
};
const fail = (kind, message) => {
  const custom = { code: 100, name: "experimental.interop.InteropError", message };
  throw new RobotRaconteurError(
    kind === "custom" ? custom : { code: errors[kind], name: `RobotRaconteur.${names[kind]}`, message },
  );
};

const part = (name, depth = 1) => ({
  name,
  size: 1,
  identify: () => `part ${name}`,
  ...(depth > 0 && { inner: part(`${name}.inner`, depth - 1) }),
});

/** A generator that tells how it was ended. */
const steps = (next) => ({
  next,
  return() {
    interop.generator_end = "closed";
    return { done: true };
  },
  throw() {
    interop.generator_end = "aborted";
    return { done: true };
  },
});

const vectors = (count) => Array.from({ length: count }, (_, i) => ({ x: 3 * i, y: 3 * i + 1, z: 3 * i + 2 }));
const samples = (count) =>
  Array.from({ length: count }, () => ({
    id: 0,
    reading: new Float64Array(3),
    tag: new Uint8Array(0),
    position: { x: 0, y: 0, z: 0 },
  }));
const ramp = (count, Type = Float64Array) => Type.from({ length: count }, (_, i) => i);

const interop = {
  version: "1",
  seen_secret: 0,
  secret: { set: (value) => void (interop.seen_secret = value) },
  seen_target: 0,
  seen_sum: 0,
  collected: new Float64Array(0),
  generator_end: "",
  answered: 0,
  answer_error: "",

  nothing() {},
  add: (left, right) => left + right,
  join: (words, separator) => words.join(separator),
  shift: (pose, dx, dy) => ({ ...pose, px: pose.px + dx, py: pose.py + dy }),
  ramp: (count) => ramp(count),
  sum: (values) => values.reduce((sum, value) => sum + value, 0),
  echo: (value) => value,
  fail: async (kind, text) => fail(kind, text),

  fire(count) {
    for (let i = 0; i < count; ++i) device.emit("changed", i, `number ${i}`);
  },
  clear: () => device.emit("cleared"),

  head: part("head"),
  parts: new Map([0, 1, 7].map((index) => [index, part(`number ${index}`)])),
  named: new Map(["left", "right hand", "a.b"].map((key) => [key, part(`named ${key}`)])),
  anything: { rrType: "experimental.interop.SpecialPart", feature: "none", ...part("special") },

  target: (value) => void (interop.seen_target = value),
  both: (value) => device.root.setWire("both", 2 * value),
  publish_state: (value) => device.root.setWire("state", value),
  publish_pose: (value) => device.root.setWire("pose", value),

  async doubled(endpoint) {
    for await (const value of endpoint) {
      if (value < 0) endpoint.close();
      else void endpoint.send(2 * value);
    }
  },
  quick: (endpoint) => interop.doubled(endpoint),
  greetings(endpoint) {
    for (const word of ["hello", "world"]) void endpoint.send(word);
  },
  async taken(endpoint) {
    interop.seen_sum = 0;
    for await (const values of endpoint) interop.seen_sum += interop.sum(values);
  },
  async publish_poses(pose, count) {
    for (let px = 0; px < count; ++px) await device.root.pipe("poses").send({ ...pose, px });
  },

  count_up(first, count) {
    let number = 0;
    return steps(() => {
      if (number < Math.abs(count)) return { value: first + number++ };
      return count < 0 ? fail("out_of_range", "no more") : { done: true };
    });
  },
  *walk(start, count) {
    for (let i = 0; i < count; ++i) yield { ...start, px: (start.px += 1) };
  },
  async *scale(factor, values) {
    for await (const value of values) yield factor * value;
  },
  async *collect(values) {
    interop.collected = [];
    for await (const part of values) {
      interop.collected = [...interop.collected, ...part];
      yield;
    }
  },

  start_ask(question) {
    void note(device.caller.call(device.root, "ask", question));
  },
  start_notice(number) {
    void note(device.caller.call(device.root, "notice", number).then(() => number));
  },

  m_numbers: ramp(100),
  m_grid: { dims: [4, 3, 2], data: ramp(24, Int16Array) },
  m_vectors: vectors(5),
  m_vector_grid: { dims: [2, 3], data: vectors(6) },
  m_samples: samples(4),
  m_sample_grid: { dims: [2, 2], data: samples(4) },
  m_fixed: ramp(10, Uint8Array),
  // By functions, as a memory that is somewhere else.
  m_large: {
    whole: ramp(50_000),
    dimensions: async () => [50_000],
    read: async ([from], [count]) => interop.m_large.whole.slice(from, from + count),
    write: async ([from], _, values) => interop.m_large.whole.set(values, from),
  },
  m_volume: { dims: [60, 50, 40], data: ramp(120_000, Float32Array) },
};

/** Properties that only store. */
for (const [, type, name] of definition.matchAll(/^ {4}property (\S+) (p_\w+)$/gm)) {
  const isNumber = /^u?int\d+$|^double$|^single$/.test(type);
  interop[name] = isNumber ? (type.endsWith("64") ? 0n : 0) : ({ bool: false, string: "", Color: 1 }[type] ?? null);
  if (/^c(double|single)$/.test(type)) interop[name] = { re: 0, im: 0 };
}

async function note(answer) {
  interop.answered = 0;
  interop.answer_error = "";
  try {
    interop.answered = await answer;
  } catch (error) {
    interop.answer_error = error.name;
  }
}

const [url, name, options = "{}"] = process.argv.slice(2);
const device = await serve({
  url,
  name,
  definition,
  type: "experimental.interop.Interop",
  service: "interop",
  object: interop,
  onChange: (isServed, reason) => console.log(JSON.stringify({ served: isServed, reason })),
  ...JSON.parse(options),
}).catch((error) => console.log(JSON.stringify({ error: error.message })));
process.stdin.resume();
process.stdin.on("end", () => void device?.close());
