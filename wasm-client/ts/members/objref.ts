// Object references. Layer: wasm-client/ts/members. Source: sessions spec sections 2.5 and 2.13.
import { make_error } from "../errors.js";
import type { CallOptions, RemoteObject } from "../types.js";
import type { MemberContext } from "./member.js";

export interface AnyObjRef {
  get(index?: unknown, options?: CallOptions): Promise<RemoteObject>;
}

export function make_objref({ session, path, info, find_object }: MemberContext): AnyObjRef {
  return Object.freeze({
    get: async (given: unknown, options: CallOptions = {}) => {
      const { index, rest } = read_index(info.name, info.type, given);
      const child = session.look((core) => core.child_path(path, info.name, index));
      // Without a session the look-up itself says why.
      return find_object(child ?? path, { ...rest, ...options });
    },
  } satisfies AnyObjRef);
}

/** The index as text. Without one in the definition, CallOptions may stand first. */
function read_index(name: string, type: string, given: unknown): { index: string | undefined; rest: CallOptions } {
  if (type.endsWith("{string}")) {
    if (typeof given === "string" && given !== "") return { index: given, rest: {} };
    throw make_error("InvalidArgument", `${name}: expected a string as index, which may not be empty`);
  }
  if (type.endsWith("{int32}") || type.endsWith("[]")) {
    const number = typeof given === "bigint" ? Number(given) : given;
    if (typeof number === "number" && Number.isInteger(number) && Math.abs(number) < 2 ** 31) {
      return { index: String(number), rest: {} };
    }
    throw make_error("InvalidArgument", `${name}: expected an int32 as index`);
  }
  if (given === undefined || given === null) return { index: undefined, rest: {} };
  if (typeof given === "object") return { index: undefined, rest: given };
  throw make_error("InvalidArgument", `${name}: is one object, it takes no index`);
}
