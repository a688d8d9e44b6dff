// Properties. Layer: wasm-client/ts/members. Source: sessions spec section 2.9.
import type { PropertyMember } from "../types.js";
import type { MemberContext } from "./member.js";

export function makeProperty({ session, path, info }: MemberContext): PropertyMember<unknown> {
  return Object.freeze({
    get: async (options = {}) => session.request((core) => core.getProperty(path, info.name), options),
    set: async (value: unknown, options = {}) => {
      await session.command(path, (core) => core.setProperty(path, info.name, value), options);
    },
  } satisfies PropertyMember<unknown>);
}
