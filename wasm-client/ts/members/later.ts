// Members that this version does not carry out yet: there, with the names that they will have. Layer: wasm-client/ts/members.
import { make_error } from "../errors.js";
import type { MemberContext } from "./member.js";

const operations = {
  memory: ["read", "write", "length"],
} as const;

export function make_later({ info }: MemberContext, kind: keyof typeof operations): object {
  const refuse = async () => {
    throw make_error("NotImplementedError", `${kind} ${info.name}: ${kind}s are not available yet`);
  };
  return Object.freeze(Object.fromEntries(operations[kind].map((operation) => [operation, refuse])));
}
