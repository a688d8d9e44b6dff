// Functions: called by position. Layer: wasm-client/ts/members. Source: sessions spec section 2.9.
import { make_error } from "../errors.js";
import type { CallOptions, RrValue } from "../types.js";
import { signature } from "./member.js";
import type { MemberContext } from "./member.js";

type Call = (...args: unknown[]) => Promise<RrValue | undefined>;

export function make_function({ session, path, info }: MemberContext): Call {
  const count = info.parameters.length;
  const is_void = info.type === "void";
  const call = async (...args: unknown[]) => {
    if (is_generator(info.type, info.parameters)) {
      throw make_error("NotImplementedError", `${info.name} is a generator function: not available yet`);
    }
    const options = args.length === count + 1 ? check_options(signature(info), args[count]) : {};
    if (args.length < count || args.length > count + 1) {
      throw make_error("InvalidArgument", `${signature(info)}: got ${args.length} arguments, expected ${count}`);
    }
    const value = await session.request(
      (core) => core.call_function(path, info.name, args.slice(0, count)),
      options,
    );
    return is_void ? undefined : value;
  };
  return Object.defineProperty(call, "name", { value: info.name });
}

function is_generator(type: string, parameters: readonly { type: string }[]): boolean {
  return type.endsWith("{generator}") || (parameters.at(-1)?.type.endsWith("{generator}") ?? false);
}

/** The argument behind the last parameter; anything else there is one argument too many. */
function check_options(what: string, given: unknown): CallOptions {
  if (given === undefined) return {};
  if (typeof given === "object" && given !== null && Object.keys(given).every((key) => key === "signal" || key === "timeout")) {
    return given;
  }
  throw make_error("InvalidArgument", `${what}: the argument behind the last parameter is not {signal, timeout}`);
}
