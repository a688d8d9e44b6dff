// What a client asks of an object, answered by what its author wrote. Layer: wasm-client/ts.
import { makeError } from "../errors.js";
import { ValueQueue } from "../members/queue.js";
import type { MemberInfo, RrValue } from "../types.js";
import { readMemory, shapeOf, writeMemory } from "./memories.js";
import type { Memory } from "./memories.js";
import type { Implementation, ServedObject } from "./served_object.js";
import type { ServiceCall } from "./service_module.js";

type Steps = Iterator<unknown> | AsyncIterator<unknown>;

/** A generator that a client runs. */
interface Run {
  /** Not there yet while an async function makes them. */
  steps?: Steps;
  /** What its steps bring, where the function takes that. */
  values: ValueQueue<RrValue> | undefined;
}

/** A property that is read and written by functions. */
interface Accessor {
  get?(): unknown;
  set?(value: RrValue): unknown;
}

const generatorSuffix = "{generator}";

/** The generators of one client, and the answers to its calls. */
export class Answers {
  readonly #runs = new Map<number, Run>();

  /** @returns what answers the call. What is thrown does, too. */
  answer(call: ServiceCall): unknown {
    const { object, member, value } = call;
    const { implementation } = object;
    switch (call.call) {
      case "property_get":
        return getProperty(object, member);
      case "property_set":
        return setProperty(implementation, member, value);
      case "function":
        return functionOf(object, member)(...call.arguments);
      case "peek_in":
        return valueOf(object.inValues, member);
      case "peek_out":
        return valueOf(object.outValues, member);
      case "poke_out":
        return takeOutValue(object, member, value);
      case "generator_open":
        return this.#open(call);
      case "generator_next":
        return this.#next(call);
      case "generator_close":
        return this.end(call.generator);
      case "generator_abort":
        return this.end(call.generator, makeError("OperationAborted", "the client has aborted the generator"));
      case "memory_dimensions":
        return shapeOf(memoryOf(object, member));
      case "memory_read":
        return readMemory(memoryOf(object, member), call.position, call.count);
      case "memory_write":
        return writeMemory(memoryOf(object, member), call.position, call.count, value);
    }
  }

  /** A generator is not asked any more. `reason`: what is thrown into it; without one it returns. */
  end(generator: number, reason?: unknown): void {
    const run = this.#runs.get(generator);
    if (!run || !this.#runs.delete(generator)) return;
    run.values?.end();
    if (run.steps) leave(run.steps, reason);
  }

  /** The client is gone. */
  endAll(): void {
    for (const generator of [...this.#runs.keys()]) this.end(generator);
  }

  async #open({ object, member, arguments: args, generator }: ServiceCall): Promise<void> {
    const takesValues = object.members.get(member)?.parameters.at(-1)?.type.endsWith(generatorSuffix) ?? false;
    const values = takesValues ? new ValueQueue<RrValue>(Infinity, () => undefined) : undefined;
    const iterable = values && { [Symbol.asyncIterator]: () => values };
    const run: Run = { values };
    this.#runs.set(generator, run);
    try {
      const made = await functionOf(object, member)(...args, ...(iterable ? [iterable] : []));
      run.steps = stepsOf(made, member);
    } catch (error) {
      this.#runs.delete(generator);
      throw error;
    }
    if (!this.#runs.has(generator)) leave(run.steps); // the client has gone meanwhile
  }

  async #next({ generator, value }: ServiceCall): Promise<unknown> {
    const run = this.#runs.get(generator);
    if (!run?.steps) throw makeError("InvalidOperation", "the generator has ended");
    run.values?.push(value);
    const step = await run.steps.next();
    if (!this.#runs.has(generator)) throw makeError("OperationAborted", "the generator was ended");
    if (!step.done) return step.value;
    this.#runs.delete(generator);
    throw makeError("StopIteration", "the generator has no more");
  }
}

/** A newer OutValue of a client. */
export function takeOutValue(object: ServedObject, wire: string, value: RrValue): void {
  object.outValues.set(wire, value);
  const handler = object.implementation[wire];
  if (typeof handler === "function") (handler as (value: RrValue) => unknown).call(object.implementation, value);
}

/** The implementation of the object behind an objref. */
export function childOf(object: ServedObject, member: string, index: string | undefined): Implementation {
  const key = keyOf(object, member, index);
  const given = object.implementation[member];
  let child = given;
  if (typeof given === "function") child = (given as (key: unknown) => unknown).call(object.implementation, key);
  else if (given instanceof Map) child = given.get(key);
  else if (key !== undefined && typeof given === "object" && given !== null) {
    child = Object.hasOwn(given, key) ? (given as Implementation)[key] : undefined;
  }
  if (typeof child === "object" && child !== null && !(child instanceof Promise)) return child as Implementation;
  if (child instanceof Promise)
    throw makeError("InvalidOperation", `objref "${member}" is async: its objects have to be there`);
  throw makeError("ObjectNotFound", `there is no object ${member}${index === undefined ? "" : `[${index}]`}`);
}

/** What the objects behind an objref are told apart by; undefined where it has no index. */
export function keyOf(object: ServedObject, objref: string, index: string | undefined): string | number | undefined {
  const { type } = object.members.get(objref) as MemberInfo;
  return type.endsWith("[]") || type.endsWith("{int32}") ? Number(index) : index;
}

/** Only what has the functions as its own: a Map and a TypedArray are values. */
function accessorOf(value: unknown): Accessor | undefined {
  if (typeof value !== "object" || value === null) return undefined;
  const isFunction = (name: "get" | "set") =>
    Object.hasOwn(value, name) && typeof (value as Accessor)[name] === "function";
  return isFunction("get") || isFunction("set") ? value : undefined;
}

function getProperty({ implementation }: ServedObject, name: string): unknown {
  const accessor = accessorOf(implementation[name]);
  if (!(name in implementation) || (accessor && !accessor.get)) throw notImplemented(name);
  return accessor ? accessor.get?.() : implementation[name];
}

function setProperty(implementation: Implementation, name: string, value: RrValue): unknown {
  const accessor = accessorOf(implementation[name]);
  if (!(name in implementation) || (accessor && !accessor.set)) throw notImplemented(name);
  if (accessor) return accessor.set?.(value);
  implementation[name] = value;
  return undefined;
}

function functionOf({ implementation }: ServedObject, name: string): (...args: unknown[]) => unknown {
  const found = implementation[name];
  if (typeof found !== "function") throw notImplemented(name);
  return (...args) => (found as (...args: unknown[]) => unknown).apply(implementation, args);
}

function memoryOf({ implementation }: ServedObject, name: string): Memory {
  const found = implementation[name];
  if (typeof found !== "object" || found === null) throw notImplemented(name);
  return found as Memory;
}

function valueOf(values: ReadonlyMap<string, unknown>, wire: string): unknown {
  if (!values.has(wire)) throw makeError("ValueNotSet", `wire "${wire}" has no value yet`);
  return values.get(wire);
}

/** It may be in the middle of a step: it ends behind that, and nobody waits for it. */
function leave(steps: Steps, reason?: unknown): void {
  const ending = async () => (reason !== undefined && steps.throw ? steps.throw(reason) : steps.return?.());
  ending().catch(() => undefined);
}

function stepsOf(made: unknown, name: string): Steps {
  const { [Symbol.asyncIterator]: each, [Symbol.iterator]: all } = made as AsyncIterable<unknown> & Iterable<unknown>;
  if (typeof each === "function") return each.call(made);
  if (typeof all === "function") return all.call(made);
  if (typeof (made as Steps | undefined)?.next === "function") return made as Steps;
  throw makeError("InvalidOperation", `generator function "${name}" returned nothing that can be iterated`);
}

const notImplemented = (name: string) => makeError("NotImplementedError", `"${name}" is not there`);
