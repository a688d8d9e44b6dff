// Functions: called by position. Layer: wasm-client/ts/members. Source: sessions spec section 2.9.
import type { RrValue } from "../types.js";
import { isGenerator, makeGeneratorFunction } from "./generator.js";
import { signature, splitArguments } from "./member.js";
import type { MemberContext } from "./member.js";

type Call = (...args: unknown[]) => Promise<RrValue | undefined> | AsyncGenerator<RrValue | undefined>;

export function makeFunction(context: MemberContext): Call {
  const { session, path, info } = context;
  if (isGenerator(info)) return makeGeneratorFunction(context);
  const count = info.parameters.length;
  const isVoid = info.type === "void";
  const call = async (...args: unknown[]) => {
    const { values, options } = splitArguments(signature(info), count, args);
    const value = await session.command(path, (core) => core.callFunction(path, info.name, values), options);
    return isVoid ? undefined : value;
  };
  return Object.defineProperty(call, "name", { value: info.name });
}
