// A value as rows of a table, and the numbers that a plot finds in it.
import { definitions, scope } from "./arm";
import { Definitions } from "../../web/src/values/definitions";
import { readUuid } from "../../web/src/values/draft";
import { numberPaths, numberReader } from "../../web/src/values/paths";
import { rowsOf } from "../../web/src/values/rows";

describe("tables and plots", () => {
  const value = {
    pose: { x: 1.5, q: Float64Array.of(1, 2, 3), mode: 16 },
    path: null,
    limits: new Map([["a", 1]]),
    id: { uuid_bytes: readUuid("39b513e7-21b9-4b49-8654-7537473030eb") },
    arm_state_flags: 3n,
  };

  test("name enums and flags, write UUIDs, and add units", () => {
    const rows = Object.fromEntries(rowsOf(value, "Arm", definitions, scope).map((row) => [row.path, row.text]));
    expect(rows).toMatchObject({
      "pose.x": "1.5 mm",
      "pose.mode": "jog",
      id: "39b513e7-21b9-4b49-8654-7537473030eb",
      arm_state_flags: "error, ready",
    });
  });

  test("write the standard types of time as times", () => {
    const datetime = `service com.robotraconteur.datetime
struct DateTimeUTC
    field int64 seconds
    field int32 nanoseconds
end
struct Duration
    field int64 seconds
    field int32 nanoseconds
end
namedarray TimeSpec3
    field int64 microseconds
end`;
    const sample = `service com.example.sample
import com.robotraconteur.datetime
using com.robotraconteur.datetime.TimeSpec3
struct Sample
    field TimeSpec3 ts
    field com.robotraconteur.datetime.DateTimeUTC at
    field com.robotraconteur.datetime.Duration took
end`;
    const both = new Definitions([sample, datetime]);
    const texts = (ts: bigint, nanoseconds: number, took: bigint): string[] => {
      const at = { seconds: 1_795_800_413n, nanoseconds };
      const held = {
        ts: { microseconds: ts },
        at,
        took: { seconds: took, nanoseconds: took < 0n ? -500_000_000 : 20_000 },
      };
      return rowsOf(held, "Sample", both, "com.example.sample").map((row) => row.text);
    };
    expect(texts(1_795_800_413_524_096n, 7000, 12n)).toEqual([
      "2026-11-27T17:26:53.524096Z",
      "2026-11-27T17:26:53.000007Z",
      "12.000020 s",
    ]);
    expect(texts(61_000_001n, 0, -1n)).toEqual(["61.000001 s", "2026-11-27T17:26:53.000000Z", "-1.500000 s"]);
    expect(rowsOf({ ts: { microseconds: "x" } }, "Sample", both, "com.example.sample")[1]?.text).toBe("x");
  });

  test("find numbers by path, and own fields only", () => {
    expect(numberPaths(value)).toEqual(expect.arrayContaining(["pose.x", "pose.q[2]", 'limits["a"]']));
    const numberAt = (of: unknown, path: string) => numberReader(path)(of);
    expect(numberAt(value, "pose.q[2]")).toBe(3);
    expect(numberAt(value, 'limits["a"]')).toBe(1);
    expect(numberAt(value, "pose.constructor.length")).toBeUndefined();
    expect(numberAt(7, "")).toBe(7);
  });
});
