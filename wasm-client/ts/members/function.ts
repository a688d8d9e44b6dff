// Functions: called by position. Layer: wasm-client/ts/members. Source: sessions spec section 2.9.
import { make_error } from "../errors.js";
import type { CallOptions, RrValue } from "../types.js";
import { is_generator, make_generator_function } from "./generator.js";
import { signature } from "./member.js";
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

/** Arguments by position, then CallOptions where wanted. @throws RobotRaconteurError InvalidArgument */
export function split_arguments(
  what: string,
  count: number,
  args: readonly unknown[],
): { values: readonly unknown[]; options: CallOptions } {
  if (args.length < count || args.length > count + 1) {
    throw make_error("InvalidArgument", `${what}: got ${args.length} arguments, expected ${count}`);
  }
  return { values: args.slice(0, count), options: check_options(what, args[count]) };
}

/** The argument behind the last parameter; anything else there is one argument too many. */
function check_options(what: string, given: unknown): CallOptions {
  if (given === undefined) return {};
  if (typeof given === "object" && given !== null && Object.keys(given).every((key) => key === "signal" || key === "timeout")) {
    return given;
  }
  throw make_error("InvalidArgument", `${what}: the argument behind the last parameter is not {signal, timeout}`);
}
