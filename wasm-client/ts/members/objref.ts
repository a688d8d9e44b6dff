// Object references. Layer: wasm-client/ts/members. Source: sessions spec sections 2.5 and 2.13.
import { makeError } from "../errors.js";
import type { CallOptions, RemoteObject } from "../types.js";
import type { MemberContext } from "./member.js";

export interface AnyObjRef {
  get(index?: unknown, options?: CallOptions): Promise<RemoteObject>;
}

export function makeObjref({ path, info, findObject }: MemberContext): AnyObjRef {
  return Object.freeze({
    get: async (given: unknown, options: CallOptions = {}) => {
      const { index, rest } = readIndex(info.name, info.type, given);
      return findObject(childPath(path, info.name, index), { ...rest, ...options });
    },
  } satisfies AnyObjRef);
}

/** As child_path() in core/session/service_path.cpp. */
function childPath(parent: string, member: string, index: string | undefined): string {
  const path = `${parent}.${member}`;
  if (index === undefined) return path;
  const encoded = Array.from(new TextEncoder().encode(index), (byte) => {
    const letter = String.fromCharCode(byte);
    return /[A-Za-z0-9]/.test(letter) ? letter : `%${byte.toString(16).padStart(2, "0")}`;
  });
  return `${path}[${encoded.join("")}]`;
}

/** The index as text. Without one in the definition, CallOptions may stand first. */
function readIndex(name: string, type: string, given: unknown): { index: string | undefined; rest: CallOptions } {
  if (type.endsWith("{string}")) {
    if (typeof given === "string" && given !== "") return { index: given, rest: {} };
    throw makeError("InvalidArgument", `${name}: expected a string as index, which may not be empty`);
  }
  if (type.endsWith("{int32}") || type.endsWith("[]")) {
    const number = typeof given === "bigint" ? Number(given) : given;
    if (typeof number === "number" && Number.isInteger(number) && Math.abs(number) < 2 ** 31) {
      return { index: String(number), rest: {} };
    }
    throw makeError("InvalidArgument", `${name}: expected an int32 as index`);
  }
  if (given === undefined || given === null) return { index: undefined, rest: {} };
  if (typeof given === "object") return { index: undefined, rest: given };
  throw makeError("InvalidArgument", `${name}: is one object, it takes no index`);
}
