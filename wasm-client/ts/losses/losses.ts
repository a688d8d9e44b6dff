// What a service tells of this session's own subscriptions. Loaded when it is asked for. Layer: wasm-client/ts.
// Source: core/session/service/subscription_losses.hpp.
import type { CallOptions, Losses, RrValue } from "../types.js";
import type { MemberContext } from "../members/member.js";

/** `index`: of a pipe endpoint. */
export async function lossesOf(
  { session, path, info }: MemberContext,
  options: CallOptions = {},
  index?: number,
): Promise<Losses | undefined> {
  const attributes = (await session.request((core) => core.getAttributes(), options)) as Map<string, RrValue>;
  const all = attributes.get("rrgate.subscriptions");
  const numbers =
    all instanceof Map && all.get(`${path}.${info.name}${index === undefined ? "" : `[${index}]`}` as never);
  if (!(numbers instanceof Float64Array) || numbers.length !== 5) return undefined;
  const [delivered, conflated, dropped, p50, p99] = numbers as unknown as [number, number, number, number, number];
  return { delivered, conflated, dropped, ageP50: p50 * 1000, ageP99: p99 * 1000 };
}
