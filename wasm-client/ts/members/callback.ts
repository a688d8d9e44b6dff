// Callbacks: what the service asks of this client. Layer: wasm-client/ts/members. Source: sessions spec section 2.9.
import { makeError } from "../errors.js";
import type { CallbackHandler } from "../session.js";
import type { CallbackMember } from "../types.js";
import type { MemberContext } from "./member.js";

export function makeCallback({ session, path, info }: MemberContext): CallbackMember {
  return Object.freeze({
    get handler() {
      return session.handler(path, info.name);
    },
    set handler(handler: CallbackHandler | null) {
      if (handler !== null && typeof handler !== "function") {
        throw makeError(
          "InvalidArgument",
          `${info.name}.handler: found ${typeof handler}, expected a function or null`,
        );
      }
      session.setHandler(path, info.name, handler);
    },
  });
}
