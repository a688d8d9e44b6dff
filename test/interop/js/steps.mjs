// What the test clients by rrgate-client do, in Node and in a page: the steps of one scenario (../README.md, "The client").
const entry = globalThis.process ? "node.js" : "index.js"; // which of them package.json says to Node, which to a page
const { connect, ErrorCode, RobotRaconteurError, rrValue, typeOf } = await import(`../../../wasm-client/dist/${entry}`);

/** @returns what the client is to print: {results} or {connect_error}. */
export async function carry_out(url, steps) {
  let robot;
  try {
    robot = await connect(url);
  } catch (error) {
    return { connect_error: errorOf(error) };
  }
  const client = new Client(robot, url);
  const results = [];
  for (const step of steps) {
    try {
      results.push({ value: await client.carryOut(step) });
    } catch (error) {
      results.push({ error: errorOf(error) });
    }
  }
  await client.leaveAll();
  return { results };
}

const patience = 10_000; // ms for anything that has to come by itself

const service = "experimental.interop";
const numberWords = [
  "double",
  "single",
  "int8",
  "uint8",
  "int16",
  "uint16",
  "int32",
  "uint32",
  "int64",
  "uint64",
  "bool",
];
const complexWords = ["cdouble", "csingle"];

/** A scenario's value -> what rrgate-client takes. */
function build(tagged) {
  if (tagged === null || typeof tagged === "string") return tagged;
  const [[tag, body]] = Object.entries(tagged);
  const [base, rest] = tag.split("[");
  if (tag === "ramp") return Float64Array.from({ length: body }, (_, index) => index);
  if (tag === "list") return body.map(build);
  if (tag === "map{int32}" || tag === "map{string}") return new Map(body.map(([key, value]) => [key, build(value)]));
  if (tag === "varvalue") return exact(body);
  if (tag === "Color") return body;
  const isNumber = numberWords.includes(base) || complexWords.includes(base);
  // Pods are objects; the numbers of named arrays stand in one array, which rrgate-client takes as it is.
  const item = (one) => (isNumber ? scalar(base, one) : typeof one === "number" ? one : fields(one));
  if (rest === "*]") return { dims: body.dims, data: body.data.map(item) };
  if (rest === "]" || (!isNumber && Array.isArray(body))) return body.map(item);
  return item(body);
}

function scalar(type, value) {
  if (complexWords.includes(type)) return { re: value[0], im: value[1] };
  return type.endsWith("int64") ? BigInt(value) : value;
}

const fields = (body) => Object.fromEntries(Object.entries(body).map(([name, value]) => [name, build(value)]));

/** A varvalue with the type that the scenario names. */
function exact(tagged) {
  if (tagged === null || typeof tagged === "string") return tagged;
  const [[tag]] = Object.entries(tagged);
  const isNamed = /^[A-Z]/.test(tag);
  return rrValue(isNamed ? `${service}.${tag}` : tag, build(tagged));
}

/** Structs, pods and named arrays of the service's definitions: name -> {kind, fields: [[type, name]]}. */
function readSchema(texts) {
  const schema = new Map();
  for (const [, kind, name, body] of texts.join("\n").matchAll(/^(struct|pod|namedarray) (\w+)\n(.*?)\nend$/gms)) {
    schema.set(name, {
      kind,
      fields: [...body.matchAll(/^\s*field (\S+) (\w+)/gm)].map(([, type, field]) => [type, field]),
    });
  }
  return schema;
}

/** What rrgate-client gives for a value of `type` -> the plain JSON of results. */
function plain(value, type, schema) {
  if (value === null || value === undefined) return null;
  const [, base, shape, container] = /^([^[{]*)(\[[^\]]*\])?(\{\w+\})?$/.exec(type);
  const inner = base + (shape ?? "");
  if (container === "{list}") return { list: value.map((item) => plain(item, inner, schema)) };
  if (container) return plainMap(value, (item) => plain(item, inner, schema));
  if (base === "varvalue") return plainVarvalue(value, schema);
  if (shape && /\*|,/.test(shape)) return { dims: [...value.dims], data: plainItems(value.data, base, schema) };
  return shape ? plainItems(value, base, schema) : plainItem(value, base, schema);
}

function plainItems(items, base, schema) {
  if (complexWords.includes(base)) return Array.from(items.re, (re, index) => [number(re), number(items.im[index])]);
  const kind = schema.get(base)?.kind;
  const one = (item) => (kind === "pod" ? plainFields(item, base, schema) : plainItem(item, base, schema));
  return kind === "namedarray" ? items.flatMap(one) : Array.from(items, one);
}

function plainItem(value, base, schema) {
  if (complexWords.includes(base)) return [number(value.re), number(value.im)];
  const kind = schema.get(base)?.kind;
  if (kind === "namedarray")
    return schema.get(base).fields.flatMap(([type, field]) => plain(value[field], type, schema));
  if (kind === "pod") return [plainFields(value, base, schema)];
  return kind === "struct" ? plainFields(value, base, schema) : number(value);
}

const plainFields = (value, base, schema) =>
  Object.fromEntries(schema.get(base).fields.map(([type, field]) => [field, plain(value[field], type, schema)]));

function plainVarvalue(value, schema) {
  const named = typeOf(value);
  if (named) return plain(value, named.replace(`${service}.`, ""), schema);
  if (value === null || typeof value !== "object") return number(value);
  if (ArrayBuffer.isView(value)) return Array.from(value, number);
  if (value instanceof Map) return plainMap(value, (item) => plainVarvalue(item, schema));
  if (Array.isArray(value)) return { list: value.map((item) => plainVarvalue(item, schema)) };
  return { dims: [...value.dims], data: Array.from(value.data, number) };
}

function plainMap(map, one) {
  const order = ([left], [right]) => (left < right ? -1 : left > right ? 1 : 0);
  return { map: [...map].sort(order).map(([key, item]) => [key, one(item)]) };
}

function number(value) {
  if (typeof value === "bigint") return abs(value) <= 2n ** 53n ? Number(value) : value.toString();
  if (typeof value === "number") return Number.isFinite(value) ? value : String(value);
  return value;
}

const abs = (value) => (value < 0n ? -value : value);
const equal = (left, right) => JSON.stringify(left) === JSON.stringify(right);

class Client {
  #events = new Map();
  #wires = new Map();
  #pipes = new Map();
  #generators = new Map();
  #callbacks = new Map();
  #monitors = new Map();
  #others = new Map(); // roots of further clients, by name

  constructor(root, url) {
    this.root = root;
    this.url = url;
  }

  async leaveAll() {
    for (const client of [this.root, ...this.#others.values()]) await client.$.close();
  }

  /** A value of a member as plain JSON; `type` where it is not the member's own. */
  plainOf(target, member, value, type = target.$.members.find(({ name }) => name === member).type) {
    return plain(value, type, readSchema(this.root.$.types));
  }

  async carryOut(step) {
    let target = "by" in step ? this.#others.get(step.by) : this.root;
    for (const part of step.on ?? []) {
      const [name, ...index] = [part].flat();
      target = await target[name].get(...index);
    }
    const verb = Object.keys(step).find((key) => key in this.verbs);
    return this.verbs[verb].call(this, target, step[verb], step);
  }

  verbs = {
    async get(target, member) {
      return this.plainOf(target, member, await target[member].get());
    },
    async set(target, member, step) {
      await target[member].set(build(step.value));
      return null;
    },
    async call(target, member, step) {
      const result = await target[member](...(step.args ?? []).map(build));
      if (!step.digest) return this.plainOf(target, member, result);
      return digest(result);
    },
    async open(_target, name, { service, username, password }) {
      const url = this.url.replace("service=interop", `service=${service}`);
      this.#others.set(name, await connect(url, { username, password }));
      return null;
    },
    async leave(_target, name) {
      await this.#others.get(name).$.close();
      this.#others.delete(name);
      return null;
    },
    async login(target, username, { password }) {
      await target.$.login(username, password);
      return null;
    },
    async logout(target) {
      await target.$.logout();
      return null;
    },
    async lock(target, kind) {
      await target.$.lock(kind);
      return null;
    },
    async unlock(target) {
      await target.$.unlock();
      return null;
    },
    async enter(target, name, { timeout, later }) {
      const monitor = {};
      this.#monitors.set(name, monitor);
      monitor.entered = new Promise((entered, refused) => {
        const inside = () => new Promise((leave) => ((monitor.leave = leave), entered()));
        monitor.left = target.$.monitor(inside, timeout < 0 ? {} : { timeout });
        monitor.left.catch(refused);
      });
      monitor.entered.catch(() => {}); // told where it is waited for
      if (!later) await monitor.entered;
      return null;
    },
    async entered(_target, name) {
      await this.#monitors.get(name).entered;
      return null;
    },
    async exit(_target, name) {
      const { leave, left } = this.#monitors.get(name);
      leave();
      await left;
      return null;
    },
    async get_until(target, member, step) {
      return until(async () => this.plainOf(target, member, await target[member].get()), step.until);
    },
    async listen(target, member) {
      const seen = [];
      this.#events.set(member, seen);
      const { parameters } = target.$.members.find(({ name }) => name === member);
      target[member].on((...values) =>
        seen.push(values.map((value, index) => this.plainOf(target, member, value, parameters[index].type))),
      );
      return null;
    },
    async events(target, member, step) {
      const seen = this.#events.get(member);
      await until(async () => seen.length, step.count);
      return { list: seen };
    },
    async connect(target, member) {
      const wire = { connection: target[member].connect(), last: null };
      await wire.connection.ready;
      this.#wires.set(member, wire);
      (async () => {
        for await (const value of wire.connection) wire.last = this.plainOf(target, member, value);
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
    async open_pipe(target, member, step) {
      const endpoint = await target[member].connect(step.index ?? -1);
      const pipe = { endpoint, packets: [] };
      this.#pipes.set(step.as, pipe);
      (async () => {
        for await (const packet of endpoint) pipe.packets.push(this.plainOf(target, member, packet));
      })().catch(() => {});
      return endpoint.index;
    },
    async send(target, name, step) {
      const { endpoint } = this.#pipes.get(name);
      for (const value of step.values) await endpoint.send(build(value));
      return null;
    },
    async packets(target, name, step) {
      const { packets } = this.#pipes.get(name);
      await until(async () => packets.length >= step.count, true);
      return { list: [...packets] };
    },
    async close_pipe(target, name) {
      await this.#pipes.get(name).endpoint.close();
      this.#pipes.delete(name);
      return null;
    },
    async closed(target, name) {
      return until(async () => this.#pipes.get(name).endpoint.isClosed, true);
    },
    async generate(target, member, step) {
      const { type } = target.$.members.find(({ name }) => name === member);
      const run = target[member](...(step.args ?? []).map(build));
      this.#generators.set(step.as, { run, target, member, type: type.replace("{generator}", "") });
      return null;
    },
    async next(target, name, step) {
      const { run, target: object, member, type } = this.#generators.get(name);
      const { done, value } = await run.next(...("value" in step ? [build(step.value)] : []));
      // The end is no error in JavaScript; the scenarios know it as one.
      if (done) throw Object.assign(new Error(""), { name: "RobotRaconteur.StopIteration" });
      return this.plainOf(object, member, value, type);
    },
    async close_generator(target, name) {
      await this.#generators.get(name).run.return();
      return null;
    },
    async abort_generator(target, name) {
      const reason = new Error("enough");
      await this.#generators
        .get(name)
        .run.throw(reason)
        .catch((error) => {
          if (error !== reason) throw error;
        });
      return null;
    },
    async answer(target, member, step) {
      const asked = this.#callbacks.get(member) ?? [];
      this.#callbacks.set(member, asked);
      const { parameters } = target.$.members.find(({ name }) => name === member);
      target[member].handler = (...values) => {
        asked.push(values.map((value, index) => this.plainOf(target, member, value, parameters[index].type)));
        if ("fail" in step) throw failed(step.fail);
        return build(step.value);
      };
      return null;
    },
    async asked(target, member, step) {
      const asked = this.#callbacks.get(member);
      await until(async () => asked.length >= step.count, true);
      return { list: [...asked] };
    },
    async dimensions(target, member) {
      return target[member].dimensions();
    },
    async read_memory(target, member, step) {
      const read = await target[member].read(step.position, step.size);
      return step.digest ? digest(read.data ?? read) : this.plainOf(target, member, read);
    },
    async write_memory(target, member, step) {
      await target[member].write(step.position, build(step.value));
      return null;
    },
    async peek_in(target, member) {
      return this.plainOf(target, member, await target[member].peek());
    },
    async peek_out(target, member) {
      return this.plainOf(target, member, await target[member].peekOut());
    },
    async poke_out(target, member, step) {
      await target[member].poke(build(step.value));
      return null;
    },
  };
}

const digest = (items) => ({
  count: items.length,
  first: items[0],
  last: items.at(-1),
  sum: items.reduce((sum, item) => sum + item, 0),
});

/** Asks until the answer is the wanted one, for as long as patience lasts. */
async function until(ask, wanted) {
  const deadline = performance.now() + patience;
  for (;;) {
    const found = await ask();
    if (equal(found, wanted) || performance.now() > deadline) return found;
    await new Promise((resolve) => setTimeout(resolve, 10));
  }
}

const failed = (message) =>
  new RobotRaconteurError({ code: ErrorCode.OperationFailed, name: "RobotRaconteur.OperationFailed", message });

const errorOf = (error) => ({ name: error.name, message: error.message });
