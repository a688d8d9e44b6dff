// The standard types of time in words: com.robotraconteur.datetime.
// Layer: web/values, pure.

const PREFIX = "com.robotraconteur.datetime.";
const SECOND = 1_000_000n;
const YEAR_2000 = 946_684_800n * SECOND;
const YEAR_2200 = 7_258_118_400n * SECOND;

/**
 * ISO 8601 in UTC, to the microsecond; seconds for a duration, and for the time of a clock that began elsewhere.
 * undefined: `struct` is no type of time, or `value` is not of it.
 */
export function timeText(struct: string, value: object): string | undefined {
  const type = struct.startsWith(PREFIX) ? struct.slice(PREFIX.length) : "";
  const isPoint = ["TimeSpec2", "TimeSpec3", "DateTimeUTC", "DateTimeLocal"].includes(type);
  if (!isPoint && type !== "Duration") return undefined;
  const time = microsecondsOf(value as Record<string, unknown>);
  if (time === undefined) return undefined;
  const size = time < 0n ? -time : time;
  const fraction = String(size % SECOND).padStart(6, "0");
  if (!isPoint || time < YEAR_2000 || time >= YEAR_2200) return `${time < 0n ? "-" : ""}${size / SECOND}.${fraction} s`;
  return new Date(Number(time / SECOND) * 1000).toISOString().replace(".000Z", `.${fraction}Z`);
}

function microsecondsOf(value: Record<string, unknown>): bigint | undefined {
  const whole = integer(value["microseconds"]);
  if (whole !== undefined) return whole;
  const seconds = integer(value["seconds"]);
  const nanoseconds = integer(value["nanoseconds"]);
  return seconds === undefined || nanoseconds === undefined ? undefined : seconds * SECOND + nanoseconds / 1000n;
}

function integer(value: unknown): bigint | undefined {
  if (typeof value === "bigint") return value;
  return typeof value === "number" && Number.isInteger(value) ? BigInt(value) : undefined;
}
