// Callbacks: what the service asks of this client. Layer: wasm-client/ts/members. Source: sessions spec section 2.9.
import { make_error } from "../errors.js";
import type { CallbackHandler } from "../session.js";
import type { CallbackMember } from "../types.js";
import type { MemberContext } from "./member.js";

export function make_callback({ session, path, info }: MemberContext): CallbackMember {
  return Object.freeze({
    get handler() {
      return session.handler(path, info.name);
    },
    set handler(handler: CallbackHandler | null) {
      if (handler !== null && typeof handler !== "function") {
        throw make_error("InvalidArgument", `${info.name}.handler: found ${typeof handler}, expected a function or null`);
      }
      session.set_handler(path, info.name, handler);
    },
  });
}
