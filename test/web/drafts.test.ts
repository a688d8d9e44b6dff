// What is typed in for a value: it becomes a value of its type, and a value becomes what stands in the fields.
import { armService, definitions, scope, uuidService } from "./arm";
import { fitDrafts } from "../../web/src/panels/form_drafts";
import { Definitions } from "../../web/src/values/definitions";
import { draftOf, formatUuid, freeKey, makeDraft, readUuid, valueOf } from "../../web/src/values/draft";

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
    const kept = fitDrafts(
      { ...form, drafts },
      inputs,
      new Definitions([uuidService, armService, "service new"]),
      scope,
    );
    expect(kept).toEqual({ ...form, drafts });
    const other = new Definitions([armService.replace("jog = 0x10", "walk"), uuidService]);
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
