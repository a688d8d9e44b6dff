// The test client by rrgate-client, in Node: carries out the steps of one scenario (../README.md, "The client").
//
//   node client.mjs URL     reads {"steps": [...]} from standard input, prints {"results": [...]}
import { readFileSync } from "node:fs";
import { connect } from "../../../wasm-client/dist/index.js";

const patience = 10_000; // ms for anything that has to come by itself

const numbers = {
  "double": Float64Array, "single": Float32Array,
  "int8": Int8Array, "uint8": Uint8Array, "int16": Int16Array, "uint16": Uint16Array,
  "int32": Int32Array, "uint32": Uint32Array, "int64": BigInt64Array, "uint64": BigUint64Array,
  "cdouble": Float64Array, "csingle": Float32Array, "bool": Uint8Array,
};
const namedArrays = ["Vector3", "Quaternion", "Transform"];

/** A scenario's value -> what rrgate-client takes. */
function build(tagged) {
  if (tagged === null || typeof tagged === "string") return tagged;
  const [[tag, body]] = Object.entries(tagged);
  const [base, rest] = tag.split("[");
  if (tag === "ramp") return Float64Array.from({ length: body }, (_, index) => index);
  if (tag === "list") return body.map(build);
  if (tag === "map{int32}" || tag === "map{string}") return new Map(body.map(([key, value]) => [key, build(value)]));
  if (tag === "varvalue") return build(body);
  if (tag === "Color") return body;
  if (base in numbers) {
    if (rest === undefined) return scalar(base, body);
    if (rest === "]") return typedArray(base, body);
    return { dims: body.dims, data: typedArray(base, body.data) };
  }
  if (namedArrays.includes(base)) {
    return rest === "*]" ? { dims: body.dims, data: Float64Array.from(body.data) } : Float64Array.from(body);
  }
  if (rest === "]") return body.map(fields);
  if (rest === "*]") return { dims: body.dims, data: body.data.map(fields) };
  return fields(body);
}

const fields = (body) => Object.fromEntries(Object.entries(body).map(([name, value]) => [name, build(value)]));

function scalar(type, value) {
  if (type === "int64" || type === "uint64") return BigInt(value);
  if (type === "cdouble" || type === "csingle") return { re: value[0], im: value[1] };
  return value;
}

function typedArray(type, items) {
  const flat = type.startsWith("c") ? items.flat() : items;
  return numbers[type].from(flat, type.endsWith("int64") ? (item) => BigInt(item) : (item) => Number(item));
}

/** What rrgate-client gives -> the plain JSON of results. */
function plain(value) {
  if (value === null || value === undefined) return null;
  if (typeof value === "bigint") return abs(value) <= 2n ** 53n ? Number(value) : value.toString();
  if (typeof value === "number") return Number.isFinite(value) ? value : String(value);
  if (typeof value !== "object") return value;
  if (ArrayBuffer.isView(value)) return Array.from(value, plain);
  if (Array.isArray(value)) return { list: value.map(plain) };
  if (value instanceof Map) {
    const order = ([left], [right]) => (left < right ? -1 : left > right ? 1 : 0);
    return { map: [...value].sort(order).map(([key, item]) => [key, plain(item)]) };
  }
  if ("dims" in value) return { dims: [...value.dims], data: Array.isArray(value.data) ? value.data.map(plain) : plain(value.data) };
  return Object.fromEntries(Object.entries(value).map(([name, item]) => [name, plain(item)]));
}

const abs = (value) => (value < 0n ? -value : value);
const equal = (left, right) => JSON.stringify(left) === JSON.stringify(right);

class Client {
  #events = new Map();
  #wires = new Map();

  constructor(root) {
    this.root = root;
  }

  async carryOut(step) {
    let target = this.root;
    for (const part of step.on ?? []) {
      const [name, ...index] = [part].flat();
      target = await target[name].get(...index);
    }
    const verb = Object.keys(step).find((key) => key in this.verbs);
    return this.verbs[verb].call(this, target, step[verb], step);
  }

  verbs = {
    async get(target, member) {
      return plain(await target[member].get());
    },
    async set(target, member, step) {
      await target[member].set(build(step.value));
      return null;
    },
    async call(target, member, step) {
      const result = await target[member](...(step.args ?? []).map(build));
      if (!step.digest) return plain(result);
      return { count: result.length, first: result[0], last: result.at(-1), sum: result.reduce((sum, item) => sum + item, 0) };
    },
    async get_until(target, member, step) {
      return until(async () => plain(await target[member].get()), step.until);
    },
    async listen(target, member) {
      const seen = [];
      this.#events.set(member, seen);
      target[member].on((...values) => seen.push(values.map(plain)));
      return null;
    },
    async events(target, member, step) {
      const seen = this.#events.get(member);
      await until(async () => seen.length, step.count);
      return { list: seen };
    },
    async connect(target, member) {
      const wire = { connection: await target[member].connect(), last: null };
      this.#wires.set(member, wire);
      (async () => {
        for await (const value of wire.connection) wire.last = plain(value);
      })().catch(() => {});
      return null;
    },
    async close(target, member) {
      await this.#wires.get(member).connection.close();
      this.#wires.delete(member);
      return null;
    },
    async in_value(target, member, step) {
      return until(async () => this.#wires.get(member).last, step.until);
    },
    async out_value(target, member, step) {
      await this.#wires.get(member).connection.send(build(step.value));
      return null;
    },
    async peek_in(target, member) {
      return plain(await target[member].peek());
    },
    async peek_out(target, member) {
      return plain(await target[member].peekOut());
    },
    async poke_out(target, member, step) {
      await target[member].poke(build(step.value));
      return null;
    },
  };
}

/** Asks until the answer is the wanted one, for as long as patience lasts. */
async function until(ask, wanted) {
  const deadline = performance.now() + patience;
  for (;;) {
    const found = await ask();
    if (equal(found, wanted) || performance.now() > deadline) return found;
    await new Promise((resolve) => setTimeout(resolve, 10));
  }
}

const errorOf = (error) => ({ name: error.name, message: error.message });

const { steps } = JSON.parse(readFileSync(0, "utf8"));
let robot;
try {
  robot = await connect(process.argv[2]);
} catch (error) {
  console.log(JSON.stringify({ connect_error: errorOf(error) }));
  process.exit(0);
}
const client = new Client(robot);
const results = [];
for (const step of steps) {
  try {
    results.push({ value: await client.carryOut(step) });
  } catch (error) {
    results.push({ error: errorOf(error) });
  }
}
console.log(JSON.stringify({ results }));
process.exit(0);
