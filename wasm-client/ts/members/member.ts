// What the faces of all members have in common. Layer: wasm-client/ts.
import type { Session } from "../session.js";
import type { MemberInfo } from "../types.js";

/** Where a member belongs, and the way to its session. */
export interface MemberContext {
  readonly session: Session;
  readonly path: string;
  readonly info: MemberInfo;
  /** The object that a path leads to; concurrent look-ups share one. */
  find_object(path: string, options?: import("../types.js").CallOptions): Promise<import("../types.js").RemoteObject>;
}

/** "Drive(velocity, radius)": for messages. */
export function signature(info: MemberInfo): string {
  return `${info.name}(${info.parameters.map((parameter) => parameter.name).join(", ")})`;
}
