// The board without a browser: where panels stand, what a file may hold, drafts, definitions, paces.
import { memberOf } from "./members";
import { packBoard, parseBoard, recallBoard, sameBoard, unpackBoard, writeBoard } from "../../web/src/board/board";
import type { Board } from "../../web/src/board/board";
import { Keeper } from "../../web/src/board/keeper";
import { findRoom, nudge, put, settle, spread } from "../../web/src/board/layout";
import type { Placed } from "../../web/src/board/layout";
import { hasPreset, presetFor, stopFor } from "../../web/src/board/presets";
import { Pace } from "../../web/src/live/pace";
import { formatRate } from "../../web/src/live/rate";
import { splitSteps } from "../../web/src/app/router";
import { asCode } from "../../web/src/panels/code";
import { hexLines, greyPicture } from "../../web/src/panels/bytes";
import { fitDrafts } from "../../web/src/panels/form_drafts";
import { sharedUnit, sourcesOf, withSources } from "../../web/src/panels/plot_sources";
import { lonely, measuredAt, Trace, toCsv } from "../../web/src/panels/trace";
import type { Frame } from "../../web/src/camera/frame";
import { readPicture } from "../../web/src/camera/pixels";
import type { Member } from "../../web/src/robot/remote";
import { ROBOT_STOP } from "../../web/src/robot/stop";
import { Definitions, flagNames, scopeOf } from "../../web/src/values/definitions";
import { draftOf, formatUuid, freeKey, jsonOf, makeDraft, readUuid, valueOf } from "../../web/src/values/draft";
import { numberPaths, numberReader } from "../../web/src/values/paths";
import { rowsOf } from "../../web/src/values/rows";
import { unitOf } from "../../web/src/values/units";

const text = `service com.example.arm
stdver 0.10
import com.robotraconteur.uuid
using com.robotraconteur.uuid.UUID
using com.robotraconteur.uuid.UUID as Name
enum Mode
    off = -1,
    halt, jog = 0x10,
    run
end
enum ArmStateFlags
    unknown = 0, error = 0x1, ready = 0x2, high = 0x40000
end
struct Pose
    ## Where it is [mm]
    field double x
    field double[3] q
    field Mode mode
end
struct Arm
    field Pose pose
    field Pose{list} path
    field double{string} limits
    field UUID id
    field Name other
    field uint64 arm_state_flags
    field uint8[] __proto__
    field Arm{list} inner
end
object Robot
    property double then
end
`;
const uuid = `service com.robotraconteur.uuid
namedarray UUID
    field uint8[16] uuid_bytes
end`;
const definitions = new Definitions([text, uuid]);
const scope = "com.example.arm";

describe("definitions", () => {
  test("have structs, enums with their numbers, and the documentation of fields", () => {
    expect(definitions.struct("Arm", scope)?.fields.map(({ name }) => name)).toContain("__proto__");
    expect([...(definitions.enum("Mode", scope)?.values ?? [])]).toEqual([
      ["off", -1],
      ["halt", 0],
      ["jog", 16],
      ["run", 17],
    ]);
    expect(definitions.struct("Name", scope)?.name).toBe("com.robotraconteur.uuid.UUID");
    expect(definitions.struct("constructor", scope)).toBeUndefined();
    expect(unitOf("Arm", "pose.x", definitions, scope)).toBe("mm");
    expect(unitOf("Arm", "__proto__", definitions, scope)).toBe("");
    expect(scopeOf("a.b.C")).toBe("a.b");
  });

  test("name the flags that are set, and the rest as a number", () => {
    const flags = definitions.flags("arm_state_flags", scope);
    expect(flags && flagNames(0x40003n, flags)).toEqual(["error", "ready", "high"]);
    expect(flags && flagNames(9, flags)).toEqual(["error", "0x8"]);
    expect(definitions.flags("arm_state", scope)).toBeUndefined();
  });
});

describe("drafts", () => {
  test("become values of their types, and back", () => {
    const draft = makeDraft("Arm", definitions, scope);
    if (draft.kind !== "struct" || draft.fields === null) throw new Error("no struct");
    const pose = draft.fields.get("pose");
    if (pose?.kind !== "struct") throw new Error("no pose");
    pose.fields?.set("mode", { kind: "text", text: "jog" }).set("q", { kind: "text", text: "1, 2, 3" });
    draft.fields.set("limits", {
      kind: "map",
      entries: [{ key: "__proto__", value: { kind: "text", text: "2.5" } }],
    });
    draft.fields.set("id", { kind: "text", text: "39b513e7-21b9-4b49-8654-7537473030eb" });
    draft.fields.set("__proto__", { kind: "text", text: "7" });
    const value = valueOf(draft, "Arm", definitions, scope) as Record<string, any>;
    expect(value["pose"]["mode"]).toBe(16);
    expect(Array.from(value["pose"]["q"] as Float64Array)).toEqual([1, 2, 3]);
    expect([...value["limits"]]).toEqual([["__proto__", 2.5]]);
    expect(Object.getPrototypeOf(value)).toBeNull();
    expect(Array.from(value["__proto__"] as Uint8Array)).toEqual([7]);
    expect(formatUuid(value["id"].uuid_bytes)).toBe("39b513e7-21b9-4b49-8654-7537473030eb");
    const again = draftOf(value, "Arm", definitions, scope);
    expect(again.kind === "struct" && again.fields?.get("id")).toEqual(draft.fields.get("id"));
    expect(({} as Record<string, unknown>)["7"]).toBeUndefined();
  });

  test("stay in a form over an outage, unless their type is another one", () => {
    const inputs = [
      { name: "arm", type: "Arm" },
      { name: "speed", type: "double" },
      { name: "mode", type: "Mode" },
    ];
    const typed = (draft: string) => ({ kind: "text", text: draft }) as const;
    const form = fitDrafts(null, inputs, definitions, scope);
    const [arm = typed("")] = form.drafts;
    const drafts = [arm, typed("30"), typed("jog")];
    const kept = fitDrafts({ ...form, drafts }, inputs, new Definitions([uuid, text, "service new"]), scope);
    expect(kept).toEqual({ ...form, drafts });
    const other = new Definitions([text.replace("jog = 0x10", "walk"), uuid]);
    const fitted = fitDrafts(kept, inputs, other, scope);
    expect(fitted.drafts).toEqual([makeDraft("Arm", other, scope), typed("30"), typed("off")]);
    expect(fitted.emptied).toEqual(["mode"]); // in the others nothing was typed, or nothing is lost
    const renamed = [{ name: "speed", type: "single" }];
    expect(fitDrafts(kept, renamed, definitions, scope)).toMatchObject({ drafts: [typed("0")], emptied: ["speed"] });
  });

  const read = (value: unknown, type: string) => draftOf(value, type, definitions, scope);
  const written = (draft: ReturnType<typeof read>, type: string) => valueOf(draft, type, definitions, scope);
  const edited = (value: unknown, text: string, type = "varvalue") =>
    written({ ...read(value, type), text } as never, type);

  test("that nobody has changed are written as they were read", () => {
    for (const value of [
      Float64Array.of(1),
      Float32Array.of(1.5, -2),
      BigInt64Array.of(9007199254740993n),
      new Uint8Array(0),
      "12",
      "",
      null,
      { x: 1 },
      new Map([[1, "a"]]),
      [Int16Array.of(1), "a"],
    ])
      expect(written(read(value, "varvalue"), "varvalue")).toBe(value);
    for (const [type, value] of [
      ["cdouble", { re: 1, im: -2 }],
      ["cdouble[]", { re: Float64Array.of(1), im: Float64Array.of(-2) }],
      ["double[*]", { dims: [1, 1], data: Float64Array.of(3) }],
      ["string{list}", null],
      ["double{int32}", null],
    ] as const)
      expect(written(read(value, type), type), type).toBe(value);
    expect(written(read(null, "Arm"), "Arm")).toBeNull();
    const map = read(new Map<string, unknown>([["a", Float64Array.of(1)]]), "varvalue{string}");
    expect(written(map, "varvalue{string}")).toEqual(new Map([["a", Float64Array.of(1)]]));
  });

  test("of a varvalue stay of the type that was read", () => {
    expect(edited(Float64Array.of(1), "12")).toEqual(Float64Array.of(12));
    expect(edited(Float32Array.of(1.5), "[2.5, 3]")).toEqual(Float32Array.of(2.5, 3));
    expect(edited(BigUint64Array.of(1n), "18446744073709551615")).toEqual(BigUint64Array.of(2n ** 64n - 1n));
    expect(() => edited(Uint8Array.of(1), "256")).toThrow("element 0: 256 is out of range; expected uint8, 0 to 255");
    expect(edited(Int32Array.of(2), "2.5")).toEqual(Float64Array.of(2.5));
    expect(edited(Int32Array.of(2), "")).toBeNull();
    expect(edited("on", "12")).toBe("12");
    expect(edited("on", "")).toBe("");
    expect(edited(null, "12")).toBe(12);
    expect(edited({ x: 1 }, '{"x": 2}')).toEqual({ x: 2 });
    const pose = Object.defineProperty({ x: 1 }, Symbol.for("rrgate.type"), { value: "com.example.arm.Pose" });
    expect(edited(pose, '{"x": 2}')).toEqual({ type: "com.example.arm.Pose", value: { x: 2 } });
    expect(() => edited(pose, "x: 2")).toThrow("is not valid JSON; expected com.example.arm.Pose");
    expect(edited(pose, "")).toBeNull();
    expect(edited(new Map([[1, "a"]]), '{"2": "b"}')).toEqual(new Map([[2, "b"]]));
    expect(edited(new Map([["1", "a"]]), '{"2": "b"}')).toEqual(new Map([["2", "b"]]));
    expect(edited({ dims: [1], data: Float32Array.of(1) }, '{"dims": [1], "data": [2]}')).toEqual({
      dims: [1],
      data: Float32Array.of(2),
    });
    expect(edited({ re: 1, im: -2 }, "[3, 4]", "cdouble")).toEqual({ re: 3, im: 4 });
    expect(written({ kind: "list", items: [] }, "string{list}")).toEqual([]);
  });

  test("of a map have each key once", () => {
    const entry = (key: string) => ({ key, value: { kind: "text", text: "1" } as const });
    expect(freeKey([entry("1"), entry("0"), entry(" 0x2")], "int32")).toBe("3");
    expect(freeKey([entry("key2"), entry("x")], "string")).toBe("key1");
    expect(freeKey([entry("key1"), entry("key2")], "string")).toBe("key3");
    const twice = { kind: "map" as const, entries: [entry("2"), entry("0x2")] };
    expect(written({ kind: "map", entries: twice.entries }, "double{string}")).toEqual(
      new Map([
        ["2", 1],
        ["0x2", 1],
      ]),
    );
    expect(() => written(twice, "double{int32}")).toThrow('key "0x2" stands twice');
    twice.entries[1] = entry("2");
    expect(() => written(twice, "double{string}")).toThrow('key "2" stands twice');
  });

  test("say which field is wrong", () => {
    const draft = makeDraft("Pose", definitions, scope);
    if (draft.kind !== "struct") throw new Error("no struct");
    draft.fields?.set("mode", { kind: "text", text: "fly" });
    expect(() => valueOf(draft, "Pose", definitions, scope)).toThrow(
      'mode: "fly" is no Mode; expected one of off, halt, jog, run',
    );
    expect(() => readUuid("12")).toThrow('"12" is no UUID');
  });
});

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

  test("keep what a window shows, and write a file that no spreadsheet runs", () => {
    const trace = new Trace(2);
    for (let i = 0; i <= 10; i++) trace.push(i * 1000, [i]);
    expect(trace.window(3)[0]).toEqual([-3, -2, -1, 0]);
    expect(toCsv(["time_s", '=A1,"x"'], new Trace(1))).toBe(`time_s,"'=A1,""x"""\n`);
    expect(toCsv(["t", "a", "b"], trace).split("\n")[2]).toBe("1,1,");
  });

  test("of several sources, each has cells where it was measured", () => {
    const trace = new Trace(2, 2);
    trace.push(0, [1], 0, 1);
    trace.push(500, [7], 1, 1);
    trace.push(1000, [2], 0, 1);
    trace.breakOff(1, 1);
    expect(trace.window(30)).toEqual([
      [-1, -0.5, 0, 0],
      [1, undefined, 2, undefined],
      [undefined, 7, undefined, null],
    ]);
    const [, first = [], second = []] = trace.window(30);
    expect([lonely(first), lonely(second)]).toEqual([null, [1]]);
    expect([measuredAt(first, 3), measuredAt(second, 0)]).toEqual([2, 1]);
    expect(toCsv(["t", "a", "b"], trace).split("\n")[2]).toBe("0.5,,7");
  });

  test("of several members are kept in the settings, which boards of one member have, too", () => {
    const before = { member: "state", paths: ["x"], seconds: 10 };
    const sources = sourcesOf(before, "packets");
    expect(sources).toEqual([{ member: "state", paths: ["x"] }]);
    expect(sourcesOf({}, "packets")).toEqual([{ member: "packets", paths: [] }]);
    const both = withSources(before, [...sources, { member: "speed", paths: [] }]);
    expect(both).toEqual({ ...before, more: [{ member: "speed" }] });
    expect(sourcesOf(both, "")).toEqual([...sources, { member: "speed", paths: [] }]);
    expect(withSources(both, sources)).toEqual(before);
    expect(sourcesOf({ member: "a", more: [7, null, { member: 1 }, { member: "a" }, { member: "b" }] }, "")).toEqual([
      { member: "a", paths: [] },
      { member: "b", paths: [] },
    ]);
    expect([sharedUnit(["mm", "mm"]), sharedUnit(["mm", ""]), sharedUnit([])]).toEqual(["mm", "", ""]);
  });

  test("draw no line over an outage, and leave out what is no finite number", () => {
    const trace = new Trace(2);
    trace.breakOff(); // nothing came before
    trace.push(0, [1, NaN]);
    trace.push(1000, [2, Infinity]);
    const before = trace.pushed;
    trace.breakOff();
    trace.push(9000, [3, 4]);
    expect(trace.pushed).toBe(before + 2);
    expect(trace.window(30)).toEqual([
      [-9, -8, -8, 0],
      [1, 2, null, 3],
      [null, null, null, 4],
    ]);
    expect(lonely(trace.window(30)[1] ?? [])).toEqual([3]);
    expect(lonely([1, 2, null])).toBeNull();
  });
});

describe("a pace", () => {
  test("is stale after three periods, and never where there is none", () => {
    const pace = new Pace();
    for (let t = 0; t <= 1000; t += 200) pace.hear(t);
    expect(pace.periodMs).toBe(200);
    expect(pace.isStale(1590)).toBe(false);
    expect(pace.isStale(1610)).toBe(true);
    expect(pace.rate(1610)).toBe(0);
    const once = new Pace();
    once.hear(0);
    expect(once.isStale(1e6)).toBe(false);
  });

  /** What is said at the end, and the most that is ever said on the way. */
  const rates = (times: readonly number[]): { last: number; most: number } => {
    const pace = new Pace();
    const said = times.map((t) => (pace.hear(t), pace.rate(t)));
    return { last: said.at(-1) ?? 0, most: Math.max(...said) };
  };
  const every = (ms: number, from: number, to: number): number[] =>
    Array.from({ length: Math.floor((to - from) / ms) + 1 }, (_, i) => from + i * ms);
  /** `count` within `takesMs`, beginning at each of `starts`. */
  const bursts = (starts: readonly number[], count: number, takesMs: number): number[] =>
    starts.flatMap((start) => every(takesMs / count, start, start + takesMs).slice(0, count));

  test.each([
    ["single ones, fast", every(1, 0, 5_000), 1_000],
    ["single ones", every(50, 0, 5_000), 20],
    ["single ones, slow", every(5_000, 0, 20_000), 0.2],
    ["bursts at once", bursts(every(500, 0, 5_000), 10, 1), 20],
    ["bursts of some time", bursts(every(500, 0, 5_000), 50, 100), 100],
    ["bursts that are rare", bursts(every(5_000, 0, 20_000), 100, 30), 20],
    [
      "what a busy page hears late",
      [...every(10, 0, 5_000), ...bursts([6_000], 100, 20), ...every(10, 6_020, 9_000)],
      100,
    ],
    [
      "what waited while the page slept",
      [...every(10, 0, 3_000), ...bursts([60_000], 5_000, 400), ...every(10, 60_400, 64_000)],
      100,
    ],
    ["a backlog, then single ones", [...bursts([0], 300, 200), ...every(50, 200, 4_000)], 20],
    ["single ones with a pause", [...every(50, 0, 1_000), ...every(50, 60_000, 61_500)], 20],
  ])("has the rate of what comes over time: %s", (_, times, rate) => {
    const { last, most } = rates(times);
    expect(last).toBeGreaterThan(rate * 0.9);
    expect(last).toBeLessThan(rate * 1.1);
    expect(most).toBeLessThan(rate * 2);
  });

  test("has a rate in words that is as long for 9.96 as for 10.04", () => {
    expect([0.2, 9.94, 9.96, 10.04, 123.4].map(formatRate)).toEqual(["0.2", "9.9", "10", "10", "123"]);
  });

  test("has no rate of a single burst", () => {
    expect(rates(bursts([0], 50, 120)).most).toBe(0);
    expect(rates([0, ...bursts([60_000], 50, 120)]).most).toBeLessThan(1);
  });

  test("of bursts is not stale between them", () => {
    const pace = new Pace();
    for (const t of bursts(every(500, 0, 3_000), 50, 20)) pace.hear(t);
    expect(pace.isStale(3_499)).toBe(false);
    expect(pace.isStale(4_600)).toBe(true);
  });
});

describe("the layout", () => {
  const panels: Placed[] = [
    { id: "a", x: 0, y: 0, w: 6, h: 4 },
    { id: "b", x: 6, y: 0, w: 6, h: 4 },
    { id: "c", x: 0, y: 4, w: 12, h: 3 },
  ];
  const overlaps = (all: readonly Placed[]): number =>
    all.flatMap((a) =>
      all.filter((b) => a.id < b.id && a.x < b.x + b.w && b.x < a.x + a.w && a.y < b.y + b.h && b.y < a.y + a.h),
    ).length;

  test("makes room for what is moved, and nothing overlaps or floats", () => {
    const moved = put(panels, "c", { y: 0 });
    expect(overlaps(moved)).toBe(0);
    expect(moved.find(({ id }) => id === "c")?.y).toBe(0);
    expect(moved.find(({ id }) => id === "a")?.y).toBe(3);
    expect(put(panels, "a", { w: 99, h: 0, x: -5 }).find(({ id }) => id === "a")).toMatchObject({ x: 0, w: 12, h: 3 });
    expect(settle([{ id: "x", x: 3, y: 50, w: 2, h: 3 }])[0]?.y).toBe(0);
  });

  test("changes places with what is below, step by step", () => {
    let now = panels;
    for (let i = 0; i < 8; i++) now = nudge(now, "c", 0, -1);
    expect(now.find(({ id }) => id === "c")?.y).toBe(0);
    for (let i = 0; i < 12; i++) now = nudge(now, "c", 0, 1);
    expect(now.find(({ id }) => id === "c")?.y).toBe(4);
    expect(overlaps(now)).toBe(0);
  });

  test("finds the first free place", () => {
    expect(findRoom(panels, { w: 4, h: 4 })).toEqual({ x: 0, y: 7, w: 4, h: 4 });
    expect(findRoom([], { w: 40, h: 4 })).toEqual({ x: 0, y: 0, w: 12, h: 4 });
  });

  test("spreads over a wider screen, in order, and is as it was on a desk", () => {
    const wide = spread(panels, 12, 24);
    expect(wide.map(({ x, y, w }) => [x, y, w])).toEqual([
      [0, 0, 6],
      [6, 0, 6],
      [12, 0, 12],
    ]);
    expect(spread(panels, 12, 18).map(({ x, y }) => [x, y])).toEqual([
      [0, 0],
      [6, 0],
      [0, 4],
    ]);
    expect(spread(panels, 12, 12)).toEqual(panels);
  });

  test("that was arranged on a wide screen stays there, and finds room on a desk", () => {
    const arranged = put(spread(panels, 12, 24), "a", { x: 20, w: 4 }, 24);
    expect(overlaps(arranged)).toBe(0);
    expect(arranged.find(({ id }) => id === "a")).toMatchObject({ x: 20, w: 4, y: 0 });
    expect(spread(arranged, 24, 24)).toEqual(arranged);
    const folded = spread(arranged, 24, 12);
    expect(overlaps(folded)).toBe(0);
    expect(folded.every(({ x, w }) => x + w <= 12)).toBe(true);
    expect(folded.map(({ id }) => id)).toEqual(["a", "b", "c"]);
    expect(spread([{ id: "a", x: 0, y: 0, w: 24, h: 4 }], 24, 12)).toEqual([{ id: "a", x: 0, y: 0, w: 12, h: 4 }]);
  });
});

describe("a board", () => {
  const board = parseBoard(
    '{"board":1,"stop":{"call":"halt"},"panels":[{"kind":"notes","x":0,"y":9,"w":3,"h":5,"title":"für","settings":{"text":"a"}}]}',
  );

  test("goes through an address and comes back, settled", () => {
    expect(board.panels[0]?.y).toBe(0);
    const packed = packBoard(board);
    expect(packed).toMatch(/^[\w-]+$/);
    expect(writeBoard(unpackBoard(packed))).toEqual(writeBoard(board));
    const wide = '{"board":1,"columns":24,"panels":[{"kind":"notes","x":20,"y":0,"w":4,"h":5}]}';
    expect(JSON.stringify(writeBoard(parseBoard(wide)))).toContain('"columns":24');
    expect(unpackBoard(packBoard(parseBoard(wide))).panels[0]).toMatchObject({ x: 20, w: 4 });
    expect(() => unpackBoard("%%%")).toThrow("the board in it is cut off or changed");
  });

  test("is refused with what is wrong, where, and what was expected", () => {
    for (const [file, words] of [
      ["[]", "the file is [], expected an object { … }"],
      ['{"board":2}', 'field "board" is 2, expected 1'],
      [
        '{"board":1,"panels":[{"kind":"notes","x":-1,"y":0,"w":1,"h":1}]}',
        "/panels/0/x is -1, expected a whole number from 0",
      ],
      [
        '{"board":1,"panels":[{"kind":"notes","from":"100%","x":0,"y":0,"w":1,"h":1}]}',
        '/panels/0/from is "100%", expected "device/service", each percent-encoded',
      ],
      [
        '{"board":1,"panels":[{"kind":"notes","from":"arm","x":0,"y":0,"w":1,"h":1}]}',
        '/panels/0/from is "arm", expected "device/service"',
      ],
      ['{"board":1,"panels":[],"stop":{"call":1}}', "/stop/call is 1, expected the name of a function"],
      ['{"board":1,"columns":11,"panels":[]}', 'field "columns" is 11, expected a whole number from 12 to 24'],
      ["{", "the file is no JSON"],
    ] as const)
      expect(() => parseBoard(file), file).toThrow(words);
  });

  test("that this browser keeps and cannot read any more is no board", () => {
    expect(recallBoard("x", { getItem: () => "{}" })).toBeNull();
    expect(recallBoard("x", { getItem: () => JSON.stringify(writeBoard(board)) })?.stop?.call).toBe("halt");
  });

  test("begins without panels of devices that the gateway does not have", () => {
    const drive: Member = {
      name: "Drive",
      kind: "function",
      type: "void",
      parameters: [],
      modifiers: [],
      documentation: "",
    };
    const robot = {
      type: "experimental.simulatedcreate.SimulatedCreate",
      members: [drive, { ...drive, name: "FrameStream", kind: "pipe" as const, type: "WebcamImage" }],
      definitions: new Definitions([]),
      scope: "experimental.simulatedcreate",
    };
    const kinds = (devices?: string[]) => presetFor({ ...robot, devices }).panels.map(({ kind }) => kind);
    expect(kinds()).toContain("image");
    expect(kinds(["create", "webcams"])).toContain("image");
    expect(kinds(["robot-1", "robot-2"])).not.toContain("image");
    const cameras = { ...robot, type: "experimental.createwebcam2.WebcamHost", devices: ["eyes"] };
    expect(presetFor(cameras).panels.map(({ kind }) => kind)).toEqual(["image", "image"]); // of the service itself
  });

  test("starts from the type where it is known, else from the members", () => {
    const member = (name: string, kind: Member["kind"], type: string): Member => memberOf(kind, type, name);
    const members = [
      member("pose", "wire", "Pose"),
      member("halt", "function", "void"),
      member("then", "property", "double"),
    ];
    const made = presetFor({ type: "com.example.arm.Robot", members, definitions, scope });
    expect(made.panels.map(({ kind }) => kind)).toEqual(["plot", "table", "form", "table"]);
    expect(made.stop).toBeNull(); // a file's: the object's own is known only as long as the object has it
    expect(hasPreset("__proto__", definitions) || hasPreset("constructor", definitions)).toBe(false);
    const tool = "com.robotraconteur.robotics.tool.Tool";
    expect(
      presetFor({ type: tool, members: [member("open", "function", "void")], definitions, scope }).panels,
    ).toHaveLength(1);
    expect(hasPreset(tool, definitions)).toBe(true);
  });

  test("a camera's board has its settings: what there is, and the calls that read and change them", () => {
    const type = "com.robotraconteur.imaging.Camera";
    const members = [
      memberOf("property", "com.robotraconteur.param.ParameterInfo{list}", "param_info"),
      memberOf("function", "varvalue", "getf_param"),
      memberOf("function", "void", "setf_param"),
    ];
    const { panels } = presetFor({ type, members, definitions, scope: "com.robotraconteur.imaging" });
    expect(panels.map(({ kind, settings }) => [kind, settings])).toEqual([
      ["streams", {}],
      ["form", { members: ["setf_param", "getf_param"] }],
      ["table", { member: "param_info" }],
    ]);
  });

  test("fits a type that implements a standard one, however it is named there, and calls nothing that stops nothing", () => {
    const driver = new Definitions([
      "service com.example.ur\nusing com.example.base.Arm as A\nobject UR5\nimplements A\nend",
      "service com.example.base\nobject Arm\nimplements Other\nimplements com.robotraconteur.robotics.robot.Robot\nend\nobject Other\nimplements Arm\nend",
    ]);
    const type = "com.example.ur.UR5";
    expect([...driver.implemented(type)].sort()).toEqual([
      "com.example.base.Arm",
      "com.example.base.Other",
      "com.robotraconteur.robotics.robot.Robot",
    ]);
    expect(hasPreset(type, driver)).toBe(true);
    const halt = (stops: string): Member => ({
      name: "halt",
      kind: "function",
      type: stops,
      parameters: [],
      modifiers: [],
      documentation: "",
    });
    const described = { type, definitions: driver, scope: "com.example.ur" };
    expect(stopFor({ ...described, members: [halt("void")] })).toEqual(ROBOT_STOP);
    expect(stopFor({ ...described, members: [halt("double{generator}")] })).toBeNull();
    expect(presetFor({ ...described, members: [halt("void")] }).panels[0]?.kind).toBe("robot");
  });

  test("leads to objects by steps whose keys may have dots", () => {
    expect(splitSteps("Webcams[0].lens")).toEqual(["Webcams[0]", "lens"]);
    expect(splitSteps("tools[left.hand].tip")).toEqual(["tools[left.hand]", "tip"]);
  });
});

test("definitions whose blocks end with their own word are read as others", () => {
  const create = new Definitions([
    "service old.create\noption version 0.5\nstruct Packet\n    field uint8 ID\nend struct\nenum Mode\n    off, on\nend\tenum\n" +
      "object Create\n    implements old.base.Base\nend object\nstruct Last\n    field double end_time\nend",
  ]);
  expect(create.struct("Packet", "old.create")?.fields.map(({ name }) => name)).toEqual(["ID"]);
  expect([...(create.enum("Mode", "old.create")?.values ?? [])]).toEqual([
    ["off", 0],
    ["on", 1],
  ]);
  expect(create.implemented("old.create.Create")).toContain("old.base.Base");
  expect(create.struct("Last", "old.create")?.fields.map(({ name }) => name)).toEqual(["end_time"]);
});

test("code quotes what comes from the device", () => {
  const member: Member = {
    name: "Drive",
    kind: "function",
    type: "void",
    parameters: [{ name: "__proto__", type: "string" }],
    modifiers: [],
    documentation: "",
  };
  const place = { device: "it's", service: "a b", object: "Arms[x.y]" };
  const types = { definitions, scope };
  expect(asCode("curl", "http://h/", place, member, ["'; rm -rf /"], types)).toBe(
    `curl -X POST 'http://h/api/v1/devices/it'\\''s/a%20b/Arms/x.y/Drive' \\\n  -H 'Content-Type: application/json' -d '{"__proto__":"'\\''; rm -rf /"}'`,
  );
  expect(asCode("JavaScript", "http://h/", place, member, [1], types)).toContain('robot.$.find("*.Arms[x.y]")');
  expect(asCode("Python", "https://h/", { ...place, object: "" }, member, [true], types)).toContain(
    "robot.Drive(True)",
  );
  expect(asCode("Python", "https://h/", place, { ...member, kind: "wire" }, [null], types)).toContain(
    'robot.get_Arms("x.y").Drive.PokeOutValue(None)',
  );
});

test("code in JavaScript names the type of a varvalue that a script could not tell", () => {
  const member: Member = {
    name: "goal",
    kind: "property",
    type: "varvalue",
    parameters: [],
    modifiers: [],
    documentation: "",
  };
  const place = { device: "d", service: "s", object: "" };
  const pose = Object.defineProperty({ x: 1 }, Symbol.for("rrgate.type"), { value: "com.example.arm.Pose" });
  const script = (value: unknown) => asCode("JavaScript", "http://h/", place, member, [value], { definitions, scope });
  const draft = draftOf(pose, "varvalue", definitions, scope);
  expect(script(valueOf(draft, "varvalue", definitions, scope))).toContain(
    '.set(rrValue("com.example.arm.Pose", { "x": 1 }))',
  );
  const edited = valueOf({ ...draft, text: '{"x": 2}' } as never, "varvalue", definitions, scope);
  expect(script(edited)).toContain('.set(rrValue("com.example.arm.Pose", { "x": 2 }))');
  expect(script([edited])).toContain('.set([rrValue("com.example.arm.Pose", { "x": 2 })])');
  expect(script(edited)).toContain('import { connect, rrValue } from "rrgate-client";');
  expect(script({ type: "bolt", value: 1 })).toContain('.set({ "type": "bolt", "value": 1 })');
  expect(script(1)).toContain('import { connect } from "rrgate-client";');
});

test("code, tables and forms round no 64-bit integer, and keep numbers that JSON has not", () => {
  const wide = 9007199254740993n;
  const member: Member = {
    name: "count",
    kind: "property",
    type: "uint64",
    parameters: [],
    modifiers: [],
    documentation: "",
  };
  const place = { device: "d", service: "s", object: "" };
  const types = { definitions, scope };
  const value = { ["__proto__"]: [NaN], at: BigInt64Array.of(wide), of: new Map([[-1, -Infinity]]) };
  expect(JSON.stringify(jsonOf(value))).toBe('{"__proto__":["NaN"],"at":["9007199254740993"],"of":{"-1":"-Infinity"}}');
  expect(asCode("curl", "http://h/", place, member, [wide], types)).toContain(`-d '"9007199254740993"'`);
  const script = asCode("JavaScript", "http://h/", place, member, [value], types);
  expect(script).toContain(
    '.set({ ["__proto__"]: [NaN], "at": [9007199254740993n], "of": new Map([[-1, -Infinity]]) })',
  );
  for (const [type, given] of [
    ["int64", wide],
    ["double", NaN],
    ["bool", true],
  ] as const)
    expect(valueOf(draftOf(given, type, definitions, scope), type, definitions, scope), type).toBe(given);
});

test("memories are shown as bytes and as grey values", () => {
  expect(hexLines(Uint8Array.from([0x41, 0, 255]), 16)).toMatch(/^ {6}16 {2}41 00 ff +A\.\.$/);
  expect(hexLines("x", 0)).toBeNull();
  const picture = greyPicture({ dims: [1, 2], data: Float64Array.of(-1, 1) });
  expect(picture && [picture.width, picture.height, ...picture.rgba]).toEqual([2, 1, 0, 0, 0, 255, 255, 255, 255, 255]);
});

test("pictures of the standard types are read by their encoding", () => {
  const info = { width: 1, height: 1, step: 3, encoding: 0x1000 };
  expect(rgbaOf(readPicture({ image_info: info, data: Uint8Array.of(1, 2, 3) }))).toEqual([1, 2, 3, 255]);
  const bgr = readPicture({ image_info: { ...info, encoding: 0x1002 }, data: Uint8Array.of(1, 2, 3) });
  expect(rgbaOf(bgr)).toEqual([3, 2, 1, 255]);
  const depth = { image_info: { width: 2, height: 1, step: 4, encoding: 0x4000 }, data: Uint8Array.of(0, 0, 16, 39) };
  expect(rgbaOf(readPicture(depth))).toEqual([0, 0, 0, 255, 255, 255, 255, 255]);
  const jpeg = Uint8Array.of(255, 216, 255);
  expect(readPicture({ image_info: info, data: jpeg }).encoded).toBe(jpeg); // not copied
  const surplus = { image_info: { width: 2, height: 2, encoding: "rgb8" }, data: new Uint8Array(16) }; // with alpha
  expect(() => readPicture(surplus)).toThrow("16 bytes");
  const grey = { image_info: { width: 2, height: 1, step: 2, encoding: "mono8" }, data: Uint8Array.of(7, 255) };
  expect(rgbaOf(readPicture(grey))).toEqual([7, 7, 7, 255, 255, 255, 255, 255]);
  expect(() => readPicture({ image_info: { ...info, width: 9 }, data: Uint8Array.of(1, 2, 3) })).toThrow(
    "the picture has 3 bytes",
  );
});

test("a board is written at once and then not too often, and the address only while it is the board's", () => {
  vi.useFakeTimers();
  const written: string[] = [];
  const write = (text: string) => ({ store: () => written.push(text), show: () => written.push(`#${text}`) });
  const keeper = new Keeper();
  for (let i = 0; i < 300; i++) keeper.write(write(String(i)));
  expect([...written, keeper.isKept.value]).toEqual(["0", "#0", false]);
  vi.advanceTimersByTime(399);
  expect(written).toHaveLength(2);
  vi.advanceTimersByTime(10_000);
  expect([...written.splice(0), keeper.isKept.value]).toEqual(["0", "#0", "299", "#299", true]);
  keeper.write(write("now"));
  keeper.write(write("left"));
  keeper.flush(false);
  vi.advanceTimersByTime(10_000);
  expect(written).toEqual(["now", "#now", "left"]);
  vi.useRealTimers();
  const [one, other] = ["a", "b"].map((title) =>
    parseBoard(`{"board":1,"panels":[{"kind":"notes","x":0,"y":0,"w":3,"h":5,"title":"${title}"}]}`),
  ) as [Board, Board];
  expect([sameBoard(one, { ...one, panels: [...one.panels] }), sameBoard(one, other)]).toEqual([true, false]);
});

function rgbaOf({ width, height, paint }: Frame): number[] {
  const pixels = new Uint32Array(width * height);
  paint?.(pixels);
  return [...new Uint8Array(pixels.buffer)];
}
