// Every type of value, there and back, in every version of the message format.
import { rrValue, typeOf } from "../../wasm-client/dist/node.js";
import { failure, TestService } from "./service.js";
import type { NamedObject } from "./service.js";

const definition = `service test.values
stdver 0.10
enum Color
  red = 1,
  green = 2,
  blue = -3
end
namedarray Vector3
  field double x
  field double y
  field double z
end
namedarray Transform
  field Vector3[2] rows
  field double[3] offset
  field Vector3 origin
end
namedarray Bytes
  field uint8[4] head
  field uint8[2] tail
end
namedarray Wide
  field int64 low
  field int64 high
end
struct Pose
  field double px
  field string label
  field varvalue extra
end
struct Tree
  field string name
  field Tree{list} children
  field Pose{string} poses
end
pod Cell
  field int16 id
  field single value
end
pod Sample
  field int32 id
  field double[3] reading
  field uint8[8-] tag
  field Vector3 position
  field Vector3[2-] path
  field Cell cell
  field Cell[2] cells
  field double[2,2] matrix
  field Cell[2,1] grid
end
object Root
  TYPES
end`;

const types = [
  "double",
  "single",
  "int8",
  "uint8",
  "int16",
  "uint16",
  "int32",
  "uint32",
  "int64",
  "uint64",
  "cdouble",
  "csingle",
  "bool",
  "string",
  "Color",
  "double[]",
  "single[]",
  "int8[]",
  "uint8[]",
  "int16[]",
  "uint16[]",
  "int32[]",
  "uint32[]",
  "int64[]",
  "uint64[]",
  "cdouble[]",
  "csingle[]",
  "bool[]",
  "double[3]",
  "int32[4-]",
  "double[*]",
  "int16[2,3]",
  "uint8[*]",
  "cdouble[*]",
  "bool[*]",
  "int64[*]",
  "Pose",
  "Tree",
  "Cell",
  "Cell[]",
  "Cell[2]",
  "Cell[*]",
  "Sample",
  "Sample[]",
  "Vector3",
  "Vector3[]",
  "Vector3[2]",
  "Vector3[*]",
  "Transform",
  "Transform[]",
  "Bytes[]",
  "Wide",
  "double{list}",
  "string{list}",
  "double[]{list}",
  "Pose{list}",
  "double{int32}",
  "string{int32}",
  "Pose{string}",
  "string{string}",
  "Vector3[]{list}",
  "varvalue",
  "varvalue{list}",
  "varvalue{string}",
  "varvalue{int32}",
] as const;
type Type = (typeof types)[number];

const member = (type: Type) => `p${types.indexOf(type)}`;
const text = definition.replace("TYPES", types.map((type) => `property ${type} ${member(type)}`).join("\n  "));

async function service(
  options: { version?: 2 | 4; stringTable?: boolean; pieces?: number } = {},
): Promise<NamedObject> {
  return (await TestService.start({ definitions: [text], root: "test.values.Root", ...options })).connect();
}

const cell = { id: -7, value: 0.5 };
const vector = { x: 1, y: 2, z: 3 };
const other = { x: -1, y: 0, z: 1e300 };
const sample = {
  id: 2147483647,
  reading: Float64Array.of(1, 2, 3),
  tag: Uint8Array.of(9, 8),
  position: vector,
  path: [other],
  cell,
  cells: [cell, cell],
  matrix: { dims: [2, 2], data: Float64Array.of(1, 2, 3, 4) },
  grid: { dims: [2, 1], data: [cell, cell] },
};
const pose = { px: 1.5, label: "dock", extra: "note" };
const transform = { rows: [vector, other], offset: Float64Array.of(7, 8, 9), origin: vector };

/** [type, what is set, what comes back where that differs] */
const cases: [Type, unknown, unknown?][] = [
  ["double", 1.5],
  ["double", -0],
  ["double", NaN],
  ["double", Infinity],
  ["double", 5e-324],
  ["double", 7n, 7],
  ["single", 0.25],
  ["single", 0.1, Math.fround(0.1)],
  ["int8", -128],
  ["int8", 127],
  ["uint8", 255],
  ["int16", -32768],
  ["uint16", 65535],
  ["int32", -2147483648],
  ["uint32", 4294967295],
  ["int32", 5n, 5],
  ["int64", -(2n ** 63n)],
  ["int64", 2n ** 63n - 1n],
  ["int64", -5, -5n],
  ["int64", Number.MAX_SAFE_INTEGER, 2n ** 53n - 1n],
  ["uint64", 2n ** 64n - 1n],
  ["uint64", 0, 0n],
  ["cdouble", { re: 1.5, im: -2.5 }],
  ["csingle", { re: 0.5, im: 4 }],
  ["bool", true],
  ["bool", false],
  ["string", ""],
  ["string", "Zürich ✓ 🤖"],
  ["string", "\ufeffmark"],
  ["string", "a\0b"],
  ["string", "x".repeat(70_000)],
  ["Color", 2],
  ["Color", -3],
  ["Color", "blue", -3],
  ["Color", 77],
  ["double[]", Float64Array.of(1, -2.5, NaN)],
  ["double[]", [], new Float64Array()],
  ["double[]", [1, 2], Float64Array.of(1, 2)],
  ["double[]", Int16Array.of(1, -2), Float64Array.of(1, -2)],
  ["single[]", Float32Array.of(0.5)],
  ["single[]", [0.1], Float32Array.of(0.1)],
  ["int8[]", Int8Array.of(-128, 127)],
  ["uint8[]", Uint8Array.of(0, 255)],
  ["uint8[]", Uint8ClampedArray.of(3), Uint8Array.of(3)],
  ["uint8[]", new Uint8Array([9, 1, 2, 3, 9]).subarray(1, 4), Uint8Array.of(1, 2, 3)],
  ["int16[]", Int16Array.of(-32768)],
  ["uint16[]", Uint16Array.of(65535)],
  ["int32[]", Int32Array.of(-5)],
  ["uint32[]", Uint32Array.of(4294967295)],
  ["int64[]", BigInt64Array.of(-(2n ** 63n), 1n)],
  ["int64[]", [1, 2n], BigInt64Array.of(1n, 2n)],
  ["uint64[]", BigUint64Array.of(2n ** 64n - 1n)],
  ["uint64[]", Int8Array.of(3), BigUint64Array.of(3n)],
  ["int32[]", Float64Array.of(3), Int32Array.of(3)],
  ["cdouble[]", { re: Float64Array.of(1, 3), im: Float64Array.of(2, -4) }],
  ["cdouble[]", { re: [1], im: [2] }, { re: Float64Array.of(1), im: Float64Array.of(2) }],
  ["cdouble[]", [{ re: 1, im: 2 }], { re: Float64Array.of(1), im: Float64Array.of(2) }],
  ["csingle[]", { re: Float32Array.of(0.5), im: Float32Array.of(0.25) }],
  ["bool[]", [true, false, true]],
  ["bool[]", Uint8Array.of(1, 0), [true, false]],
  ["bool[]", []],
  ["double[3]", Float64Array.of(1, 2, 3)],
  ["int32[4-]", Int32Array.of()],
  ["int32[4-]", Int32Array.of(1, 2, 3, 4)],
  ["double[*]", { dims: [2, 3], data: Float64Array.of(1, 2, 3, 4, 5, 6) }],
  ["double[*]", { dims: [0, 3], data: new Float64Array() }],
  ["int16[2,3]", { dims: [2, 3], data: Int16Array.of(1, -2, 3, -4, 5, -6) }],
  ["uint8[*]", { dims: [2, 1, 2], data: Uint8Array.of(1, 2, 3, 4) }],
  ["cdouble[*]", { dims: [2], data: { re: Float64Array.of(1, 2), im: Float64Array.of(3, 4) } }],
  ["bool[*]", { dims: [2, 1], data: [true, false] }],
  ["int64[*]", { dims: [1, 1], data: BigInt64Array.of(5n) }],
  ["Pose", pose],
  ["Pose", null],
  ["Pose", { ...pose, extra: null }],
  ["Pose", { px: 1, label: "" }, { px: 1, label: "", extra: null }],
  ["Tree", { name: "a", children: [{ name: "b", children: null, poses: null }, null], poses: new Map([["p", pose]]) }],
  ["Cell", cell],
  ["Cell[]", [cell, { id: 1, value: 2 }]],
  ["Cell[]", []],
  ["Cell[2]", [cell, cell]],
  ["Cell[*]", { dims: [1, 2], data: [cell, cell] }],
  ["Sample", sample],
  ["Sample[]", [sample, { ...sample, tag: new Uint8Array(), path: [] }]],
  ["Vector3", vector],
  ["Vector3", [1, 2, 3], vector],
  ["Vector3", Float64Array.of(1, 2, 3), vector],
  ["Vector3[]", [vector, other]],
  ["Vector3[]", []],
  ["Vector3[]", Float64Array.of(1, 2, 3, -1, 0, 1e300), [vector, other]],
  ["Vector3[]", [1, 2, 3], [vector]],
  ["Vector3[]", [[1, 2, 3], vector], [vector, vector]],
  ["Vector3[2]", [vector, other]],
  ["Vector3[*]", { dims: [1, 2], data: [vector, other] }],
  ["Vector3[*]", { dims: [1], data: [1, 2, 3] }, { dims: [1], data: [vector] }],
  ["Transform", transform],
  ["Transform[]", [transform, transform]],
  ["Bytes[]", [{ head: Uint8Array.of(1, 2, 3, 4), tail: Uint8Array.of(5, 6) }]],
  ["Wide", { low: -(2n ** 63n), high: 2n ** 63n - 1n }],
  ["double{list}", [1, 2.5]],
  ["double{list}", []],
  ["double{list}", null],
  ["double{list}", undefined, null],
  ["double{list}", Float64Array.of(4), [4]],
  ["string{list}", ["a", "", "ü"]],
  ["double[]{list}", [Float64Array.of(1, 2), Float64Array.of()]],
  ["Pose{list}", [pose, null]],
  [
    "double{int32}",
    new Map([
      [-5, 1],
      [0, 2.5],
    ]),
  ],
  ["double{int32}", new Map()],
  ["string{int32}", new Map([[3, "x"]])],
  ["double{int32}", null],
  [
    "double{int32}",
    { "-5": 1, 7: 2 },
    new Map([
      [-5, 1],
      [7, 2],
    ]),
  ],
  [
    "Pose{string}",
    new Map([
      ["here", pose],
      ["", null],
    ]),
  ],
  ["string{string}", { a: "b" }, new Map([["a", "b"]])],
  [
    "string{string}",
    new Map([
      ["__proto__", "x"],
      ["constructor", "y"],
    ]),
  ],
  ["Vector3[]{list}", [[vector], []]],
  ["varvalue", null],
  ["varvalue", undefined, null],
  ["varvalue", "text"],
  ["varvalue", true, [true]],
  ["varvalue", 5, Int32Array.of(5)],
  ["varvalue", 5.5, Float64Array.of(5.5)],
  ["varvalue", 2 ** 31, Float64Array.of(2 ** 31)],
  ["varvalue", -0, Float64Array.of(-0)],
  ["varvalue", 5n, BigInt64Array.of(5n)],
  ["varvalue", 2n ** 63n, BigUint64Array.of(2n ** 63n)],
  ["varvalue", Int16Array.of(1, 2)],
  ["varvalue", [1, 2], Int32Array.of(1, 2)],
  ["varvalue", [1, 2.5], Float64Array.of(1, 2.5)],
  ["varvalue", [true, false]],
  ["varvalue", []],
  ["varvalue", ["a", 1], ["a", Int32Array.of(1)]],
  ["varvalue", { re: 1, im: 2 }, { re: Float64Array.of(1), im: Float64Array.of(2) }],
  ["varvalue", { re: Float32Array.of(1), im: Float32Array.of(2) }],
  ["varvalue", { dims: [1, 2], data: Uint8Array.of(1, 2) }],
  ["varvalue", { dims: [2], data: [1.5, 2] }, { dims: [2], data: Float64Array.of(1.5, 2) }],
  [
    "varvalue",
    { a: "x", b: [1] },
    new Map<string, unknown>([
      ["a", "x"],
      ["b", Int32Array.of(1)],
    ]),
  ],
  ["varvalue", new Map([[1, "x"]])],
  ["varvalue", new Map([["k", null]])],
  ["varvalue", rrValue("int16[]", [1, 2]), Int16Array.of(1, 2)],
  ["varvalue", rrValue("uint8", 7), Uint8Array.of(7)],
  ["varvalue", rrValue("test.values.Pose", pose), pose],
  ["varvalue", rrValue("test.values.Cell", cell), [cell]],
  ["varvalue", rrValue("test.values.Vector3[*]", { dims: [1], data: [vector] }), { dims: [1], data: [vector] }],
  ["varvalue", rrValue("double{list}", [1, 2]), [Float64Array.of(1), Float64Array.of(2)]],
  ["varvalue", rrValue("test.values.Color", "green"), Int32Array.of(2)],
  ["varvalue", rrValue("varvalue{int32}", { 1: "x" }), new Map([[1, "x"]])],
  ["varvalue{list}", ["text", Int16Array.of(1), null]],
  [
    "varvalue{string}",
    new Map<string, unknown>([
      ["a", "x"],
      ["b", pose.extra],
    ]),
  ],
  [
    "varvalue{int32}",
    new Map<number, unknown>([
      [2, "x"],
      [3, null],
    ]),
  ],
];

describe.each([
  { level: "version 2", options: { version: 2 as const, stringTable: false } },
  { level: "version 4", options: { stringTable: false } },
  { level: "version 4 with string table", options: {} },
  { level: "version 4, byte by byte", options: { pieces: 1 } },
])("$level", ({ options }) => {
  it("carries every type of value there and back", async () => {
    const root = await service(options);
    for (const [type, value, expected] of cases) {
      const property = root[member(type)]!;
      await property.set(value).catch((error: Error) => {
        throw new Error(`${type}: ${error.message}`, { cause: error });
      });
      const found = await property.get();
      expect(found, `${type} ${String(value).slice(0, 40)}`).toStrictEqual(
        expected === undefined && value !== undefined ? value : expected,
      );
    }
    await root.$.close();
  });
});

it("has a case for every type", () => {
  expect(types.filter((type) => !cases.some((row) => row[0] === type))).toEqual([]);
});

it("carries 10 MB both ways", async () => {
  const root = await service();
  const large = Float64Array.from({ length: 1_310_720 }, (_, index) => index);
  await root[member("double[]")]!.set(large);
  const found = await root[member("double[]")]!.get<Float64Array>();
  expect(found.length).toBe(large.length);
  expect(found.findIndex((number, index) => number !== index)).toBe(-1);
  await root.$.close();
});

it("remembers the named type of what came as a varvalue, so that it can be sent back", async () => {
  const root = await service();
  const property = root[member("varvalue")]!;
  await property.set(rrValue("test.values.Cell[]", [cell]));
  const found = await property.get();
  expect(typeOf(found)).toBe("test.values.Cell[]");
  await property.set(found);
  expect(await property.get()).toStrictEqual([cell]);

  await root[member("Pose")]!.set({ ...pose, extra: rrValue("test.values.Pose", pose) });
  const outer = (await root[member("Pose")]!.get()) as { extra: unknown };
  expect(typeOf(outer)).toBeUndefined();
  expect(typeOf(outer.extra)).toBe("test.values.Pose");
  await root[member("Pose")]!.set(outer);
  expect(await root[member("Pose")]!.get()).toStrictEqual({ ...pose, extra: pose });
  await root.$.close();
});

it("hands out copies: what is received stays as it is", async () => {
  const root = await service();
  const property = root[member("double[]")]!;
  await property.set([1, 2, 3]);
  const first = await property.get();
  await property.set(new Float64Array(100_000));
  await property.get();
  expect(first).toStrictEqual(Float64Array.of(1, 2, 3));
  await root.$.close();
});

describe("values that do not fit", () => {
  const throwing = {
    get px(): number {
      throw new Error("from the getter");
    },
    label: "",
    extra: null,
  };
  // With a worker, the page reads it before anybody knows what it is to be.
  const unread = process.env["IN_WORKER"] ? "could not be read" : "'p36.px' (test.values.Pose): could not be read";
  const endless: unknown[] = [];
  endless.push(endless);
  const refused: [Type, unknown, number, string][] = [
    ["int8", 300, 29, "300 does not fit int8"],
    ["int8", 1.5, 11, "1.5 is no int8"],
    ["int8", "5", 11, "found a string, expected int8"],
    ["uint8", -1, 29, "-1 does not fit uint8"],
    ["int32", NaN, 11, "is no int32"],
    ["int64", 2 ** 53, 29, "beyond the safe integers; give a bigint"],
    ["int64", 2n ** 63n, 29, "does not fit int64"],
    ["uint64", -1n, 29, "does not fit uint64"],
    ["uint64", 2n ** 64n, 29, "a bigint of more than 64 bits"],
    ["double", 2n ** 60n + 1n, 29, "does not fit double"],
    ["double", null, 20, "found null, expected double"],
    ["double", true, 11, "found a boolean, expected double"],
    ["single", 1e300, 29, "does not fit single"],
    ["bool", 1, 11, "found a number, expected a boolean"],
    ["string", 5, 11, "found a number, expected a string"],
    ["string", "\ud800", 12, "a surrogate without its other half"],
    ["string", "x\udc00y", 12, "a surrogate without its other half"],
    ["string{string}", { "\ud800": "x" }, 12, "half of a surrogate pair"],
    ["cdouble", 5, 11, "{re, im}"],
    ["cdouble", { re: 1 }, 20, "'p10.im'"],
    ["Color", "purple", 11, "'purple' is no value of test.values.Color"],
    ["double[]", "text", 11, "found a string, expected double[]"],
    ["double[]", [1, "2"], 11, "[1]': found a string"],
    ["int16[]", [1, 2, 40000], 29, "[2]': 40000 does not fit int16"],
    ["int16[]", Float64Array.of(0.5), 11, "[0]': 0.5 is no int16"],
    ["bool[]", [true, 1], 11, "[1]': found a number"],
    ["bool[]", Uint8Array.of(1, 2), 29, "2 is no bool"],
    ["double[3]", [1, 2], 12, "has 2, expected 3"],
    ["int32[4-]", [1, 2, 3, 4, 5], 12, "has 5"],
    ["double[*]", [1, 2], 11, "expected {dims, data}"],
    ["double[*]", { dims: [2, 2], data: [1, 2] }, 12, "dims"],
    ["double[*]", { dims: [-1], data: [] }, 29, "'p30.dims[0]'"],
    ["int16[2,3]", { dims: [3, 2], data: [1, 2, 3, 4, 5, 6] }, 12, "[2,3]"],
    ["cdouble[]", { re: [1], im: [] }, 12, "1 real and 0 imaginary"],
    ["Pose", { px: 1, label: "x", lable: "y" }, 12, "'p36.lable' (test.values.Pose): is not a field of the type"],
    ["Pose", { label: "x" }, 12, "'p36.px' (test.values.Pose): is missing, expected double"],
    ["Pose", 5, 11, "fields of test.values.Pose"],
    ["Pose", new Map(), 11, "found a Map"],
    ["Pose", throwing, 18, unread],
    ["Pose{list}", [pose, { px: "1", label: "" }], 11, "[1].px' (test.values.Pose)"],
    ["Cell", null, 20, "found null"],
    ["Sample", { ...sample, reading: [1] }, 12, "has 1, expected 3"],
    ["Vector3", [1, 2], 12, "has 2 numbers, expected 3"],
    ["Vector3", { x: 1, y: 2 }, 12, "'p44.z' (test.values.Vector3): is missing"],
    ["Vector3[]", [1, 2, 3, 4], 12, "has 4 numbers"],
    ["Transform", { ...transform, offset: [1] }, 12, "has 1 numbers, expected double[3]"],
    ["double{list}", "ab", 11, "an array or null"],
    ["double{int32}", { x: 1 }, 11, "has the key 'x', expected an int32"],
    ["double{int32}", { "05": 1 }, 11, "has the key '05', expected an int32"],
    ["double{int32}", new Map([[2 ** 31, 1]]), 29, "does not fit int32"],
    ["string{string}", new Map([[1, "x"]]), 11, "a string as key"],
    ["varvalue", () => 1, 11, "something that is no value"],
    ["varvalue", Symbol("s"), 11, "something that is no value"],
    ["varvalue", new Date(), 11, "something that is no value"],
    ["varvalue", endless, 12, "nested too deeply, or holds itself"],
    ["varvalue", rrValue("int8", 300), 29, "300 does not fit int8"],
    ["varvalue", rrValue("Pose", pose), 18, "type 'Pose' is not known"],
    ["varvalue", rrValue("test.values.Root", {}), 18, "is an object"],
    ["varvalue", rrValue("void", null), 18, "is not"],
    ["varvalue", rrValue("int8 x\nproperty int8", 1), 18, "is not written as in a service definition"],
    ["varvalue", rrValue("double{generator}", 1), 18, "is not"],
  ];

  it("are refused with what, where, found and expected", async () => {
    const root = await service();
    for (const [type, value, code, message] of refused) {
      const error = await failure(root[member(type)]!.set(value));
      expect(error.message, `${type} ${message}`).toContain(message);
      expect(error.code, `${type} ${message}`).toBe(code);
    }
    // The session is as good as before.
    await root[member("double")]!.set(1);
    expect(await root[member("double")]!.get()).toBe(1);
    await root.$.close();
  });

  it("do not reach the wire", async () => {
    const test = await TestService.start({ definitions: [text], root: "test.values.Root" });
    const root = await test.connect();
    const before = test.sent.length;
    await failure(root[member("int8")]!.set(300));
    await failure(root[member("double[3]")]!.set([1]));
    expect(test.sent.length).toBe(before);
    await root.$.close();
  });
});

it("never lets a received name reach a prototype", async () => {
  const root = await service();
  await root[member("varvalue")]!.set(new Map([["__proto__", new Map([["polluted", "yes"]])]]));
  const found = (await root[member("varvalue")]!.get()) as Map<string, unknown>;
  expect(found).toBeInstanceOf(Map);
  expect([...found.keys()]).toEqual(["__proto__"]);
  expect(({} as { polluted?: unknown }).polluted).toBeUndefined();
  await root.$.close();
});
