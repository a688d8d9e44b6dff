// Memories of a page that is a device. Layer: wasm-client/ts. Source: sessions spec section 2.14.
import { makeError } from "../errors.js";
import type { RrValue } from "../types.js";

type Items = unknown[] | Int32Array;

/** Items that lie side by side, column-major: the first index runs fastest. */
export interface MultiDimMemory {
  dims: ArrayLike<number>;
  data: Items;
}

/** A memory whose parts are asked for. `count` items a dimension, from `position` on. */
export interface AskedMemory {
  dimensions(): number[] | Promise<number[]>;
  read(position: number[], count: number[]): unknown;
  write(position: number[], count: number[], value: RrValue): unknown;
}

/** An array or a TypedArray, one with dimensions, or functions. */
export type Memory = Items | MultiDimMemory | AskedMemory;

export async function shapeOf(memory: Memory): Promise<bigint[]> {
  const shape = isAsked(memory) ? await memory.dimensions() : dimsOf(memory);
  return Array.from(shape, (size) => BigInt(size));
}

export function readMemory(memory: Memory, position: number[], count: number[]): unknown {
  if (isAsked(memory)) return memory.read(position, count);
  const { data } = whole(memory);
  const size = count.reduce((all, each) => all * each, 1);
  const part = makeLike(data, size);
  eachRun(dimsOf(memory), position, count, (from, to, length) => {
    for (let i = 0; i < length; ++i) part[to + i] = data[from + i];
  });
  return "dims" in memory ? { dims: count, data: part } : part;
}

export function writeMemory(memory: Memory, position: number[], count: number[], value: RrValue): unknown {
  if (isAsked(memory)) return memory.write(position, count, value);
  const { data } = whole(memory);
  const part = ("dims" in memory ? (value as unknown as MultiDimMemory).data : value) as Items;
  eachRun(dimsOf(memory), position, count, (from, to, length) => {
    for (let i = 0; i < length; ++i) data[from + i] = part[to + i];
  });
  return undefined;
}

const isAsked = (memory: Memory): memory is AskedMemory => typeof (memory as AskedMemory).dimensions === "function";
const whole = (memory: Items | MultiDimMemory): { data: Items } => ("dims" in memory ? memory : { data: memory });
const dimsOf = (memory: Items | MultiDimMemory) => ("dims" in memory ? Array.from(memory.dims) : [memory.length]);

function makeLike(items: Items, size: number): Items {
  if (Array.isArray(items)) return new Array<unknown>(size);
  return new (items.constructor as Int32ArrayConstructor)(size);
}

/** Calls `run` for all runs of the first dimension: first item of the memory, first of the part, how many. */
function eachRun(
  dims: number[],
  position: number[],
  count: number[],
  run: (from: number, to: number, length: number) => void,
): void {
  const fits = position.length === dims.length && dims.every((size, i) => position[i]! + count[i]! <= size);
  if (!fits)
    throw makeError(
      "OutOfRange",
      `position [${String(position)}], count [${String(count)}]: the memory has [${String(dims)}]`,
    );
  if (count.some((size) => size === 0)) return;
  const at = count.map(() => 0);
  for (let to = 0; ; to += count[0]!) {
    let from = 0;
    for (let i = dims.length - 1; i >= 0; --i) from = from * dims[i]! + position[i]! + at[i]!;
    run(from, to, count[0]!);
    let next = 1;
    while (next < count.length && ++at[next]! === count[next]) at[next++] = 0;
    if (next >= count.length) return;
  }
}
