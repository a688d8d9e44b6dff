// Memories: parts of large arrays. Layer: wasm-client/ts/members. Source: sessions spec section 2.14.
import type { CallOptions, MemoryMember } from "../types.js";
import type { MemberContext } from "./member.js";

type Numbers = number | readonly number[];

export function makeMemory({ session, path, info }: MemberContext): MemoryMember<unknown> {
  return Object.freeze({
    dimensions: async (options: CallOptions = {}) => {
      const found = await session.request((core) => core.getMemoryDimensions(path, info.name), options);
      return Array.from(found as BigUint64Array, Number);
    },
    read: async (position: Numbers, count: Numbers, options: CallOptions = {}) =>
      session.request((core) => core.readMemory(path, info.name, numbers(position), numbers(count)), options),
    write: async (position: Numbers, value: unknown, options: CallOptions = {}) => {
      await session.request((core) => core.writeMemory(path, info.name, numbers(position), value), options);
    },
  } satisfies MemoryMember<unknown>);
}

const numbers = (given: Numbers): readonly number[] => (typeof given === "number" ? [given] : given);
