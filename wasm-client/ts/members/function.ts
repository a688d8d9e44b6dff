// Functions: called by position. Layer: wasm-client/ts/members. Source: sessions spec section 2.9.
import type { RrValue } from "../types.js";
import { is_generator, make_generator_function } from "./generator.js";
import { signature, split_arguments } from "./member.js";
import type { MemberContext } from "./member.js";

type Call = (...args: unknown[]) => Promise<RrValue | undefined> | AsyncGenerator<RrValue | undefined>;

export function make_function(context: MemberContext): Call {
  const { session, path, info } = context;
  if (is_generator(info)) return make_generator_function(context);
  const count = info.parameters.length;
  const is_void = info.type === "void";
  const call = async (...args: unknown[]) => {
    const { values, options } = split_arguments(signature(info), count, args);
    const value = await session.request((core) => core.call_function(path, info.name, values), options);
    return is_void ? undefined : value;
  };
  return Object.defineProperty(call, "name", { value: info.name });
}
