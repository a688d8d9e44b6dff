// What the faces of all members have in common. Layer: wasm-client/ts.
import { makeError } from "../errors.js";
import type { lossesOf as of } from "../losses/losses.js";
import type { Session } from "../session.js";
import type { CallOptions, MemberInfo, RemoteObject } from "../types.js";

/** Where a member belongs, and the way to its session. */
export interface MemberContext {
  readonly session: Session;
  readonly path: string;
  readonly info: MemberInfo;
  /** Whether the service has replaced the object, and nobody has looked it up again. */
  isReleased(): boolean;
  /** The object that a path leads to; concurrent look-ups share one. */
  findObject(path: string, options?: CallOptions): Promise<RemoteObject>;
}

/** See lossesOf() in losses/losses.ts. */
export const lossesOf = async (...args: Parameters<typeof of>): ReturnType<typeof of> =>
  (await import("../losses/losses.js")).lossesOf(...args);

/** "Drive(velocity, radius)": for messages. */
export function signature(info: MemberInfo): string {
  return `${info.name}(${info.parameters.map((parameter) => parameter.name).join(", ")})`;
}

/** Arguments by position, then CallOptions where wanted. @throws RobotRaconteurError InvalidArgument */
export function splitArguments(
  what: string,
  count: number,
  args: readonly unknown[],
): { values: readonly unknown[]; options: CallOptions } {
  if (args.length < count || args.length > count + 1) {
    throw makeError("InvalidArgument", `${what}: got ${args.length} arguments, expected ${count}`);
  }
  return { values: args.slice(0, count), options: checkOptions(what, args[count]) };
}

/** The argument behind the last parameter; anything else there is one argument too many. */
function checkOptions(what: string, given: unknown): CallOptions {
  if (given === undefined) return {};
  if (
    typeof given === "object" &&
    given !== null &&
    Object.keys(given).every((key) => key === "signal" || key === "timeout")
  ) {
    return given;
  }
  throw makeError("InvalidArgument", `${what}: the argument behind the last parameter is not {signal, timeout}`);
}
