import { formatHex, formatNumber, formatValue } from "../../web/src/values/format";
import { readingsOf } from "../../web/src/values/numeric";
import { parseInput, placeholder } from "../../web/src/values/parse";
import { parseType } from "../../web/src/values/type_text";

describe("type text", () => {
  it("takes a type apart", () => {
    expect(parseType("double")).toEqual({ base: "double", array: "none", sizes: [], container: "none" });
    expect(parseType("uint8[]")).toMatchObject({ base: "uint8", array: "any" });
    expect(parseType("double[3]{list}")).toEqual({ base: "double", array: "fixed", sizes: [3], container: "list" });
    expect(parseType("int16[5-]")).toMatchObject({ array: "max", sizes: [5] });
    expect(parseType("single[*]")).toMatchObject({ array: "multidim", sizes: [] });
    expect(parseType("single[3,4]")).toMatchObject({ array: "multidim", sizes: [3, 4] });
    expect(parseType("single[3,]")).toMatchObject({ array: "multidim", sizes: [3] });
    expect(parseType("com.example.Pose{string}")).toMatchObject({ base: "com.example.Pose", container: "string" });
  });
  it("refuses what is no type, and says what it found", () => {
    expect(() => parseType("double [3]")).toThrow('"double [3]" is not a Robot Raconteur type');
    expect(() => parseType("")).toThrow();
  });
});

describe("typed input", () => {
  it("reads integers in their range, hexadecimal too", () => {
    expect(parseInput(" -32768 ", "int16")).toBe(-32768);
    expect(parseInput("0xff", "uint8")).toBe(255);
    expect(parseInput("-0x80", "int8")).toBe(-128);
    expect(() => parseInput("32768", "int16")).toThrow("32768 is out of range; expected int16, -32768 to 32767");
    expect(() => parseInput("1.5", "int32")).toThrow('"1.5" is not a whole number; expected int32');
    expect(() => parseInput("", "uint8")).toThrow('"" is not a whole number');
  });
  it("reads 64-bit integers without rounding", () => {
    expect(parseInput("9223372036854775807", "int64")).toBe(9223372036854775807n);
    expect(parseInput("18446744073709551615", "uint64")).toBe(2n ** 64n - 1n);
    expect(() => parseInput("18446744073709551616", "uint64")).toThrow("out of range");
    expect(parseInput("[9007199254740993, 1]", "int64[]")).toEqual(BigInt64Array.of(9007199254740993n, 1n));
    expect(parseInput("[9007199254740993]", "int64{list}")).toEqual([9007199254740993n]);
  });
  it("reads floating point, the special numbers by name", () => {
    expect(parseInput("-1.5e3", "double")).toBe(-1500);
    expect(parseInput("nan", "single")).toBeNaN();
    expect(parseInput("-Infinity", "double")).toBe(-Infinity);
    expect(() => parseInput("fast", "double")).toThrow('"fast" is not a number; expected a double');
    expect(() => parseInput("  ", "double")).toThrow("is not a number");
  });
  it("reads bool and string", () => {
    expect(parseInput("true", "bool")).toBe(true);
    expect(parseInput("0", "bool")).toBe(false);
    expect(() => parseInput("yes", "bool")).toThrow('"yes" is not a bool');
    expect(parseInput("  as it is  ", "string")).toBe("  as it is  ");
  });
  it("reads numeric arrays with or without brackets, and checks their length", () => {
    expect(parseInput("1, 2 3", "double[]")).toEqual(Float64Array.of(1, 2, 3));
    expect(parseInput("[1, 2]", "uint8[]")).toEqual(Uint8Array.of(1, 2));
    expect(parseInput("", "int16[]")).toEqual(new Int16Array());
    expect(() => parseInput("1, 2", "double[3]")).toThrow("found 2 elements, expected exactly 3");
    expect(() => parseInput("1, 2, 3", "double[2-]")).toThrow("found 3 elements, expected at most 2");
    expect(() => parseInput("1, 256", "uint8[]")).toThrow("element 1: 256 is out of range; expected uint8, 0 to 255");
  });
  it("reads complex and multidimensional values", () => {
    expect(parseInput("[1, -2]", "cdouble")).toEqual({ re: 1, im: -2 });
    expect(parseInput('{"dims": [2, 1], "data": [1, 2]}', "double[*]")).toEqual({
      dims: [2, 1],
      data: Float64Array.of(1, 2),
    });
    expect(() => parseInput('{"dims": [2, 2], "data": [1]}', "double[*]")).toThrow(
      "dims 2 × 2 need 4 elements, found 1",
    );
  });
  it("reads containers: lists, and maps by number and by name", () => {
    expect(parseInput("[1, 2]", "int32{list}")).toEqual([1, 2]);
    expect(parseInput('{"-5": "a"}', "string{int32}")).toEqual(new Map([[-5, "a"]]));
    expect(parseInput('{"__proto__": 1}', "double{string}")).toEqual(new Map([["__proto__", 1]]));
    expect(() => parseInput('{"x": 1}', "double{int32}")).toThrow("is not a whole number");
    expect(() => parseInput("5", "double{list}")).toThrow("expected a list");
  });
  it("reads structs and enums as JSON, and says what is no JSON", () => {
    expect(parseInput('{"x": 1}', "com.example.Pose")).toEqual({ x: 1 });
    expect(parseInput("3", "com.example.Mode")).toBe(3);
    expect(() => parseInput("{x: 1}", "com.example.Pose")).toThrow(
      '"{x: 1}" is not valid JSON; expected com.example.Pose',
    );
  });
  it("shows an example for every kind of type", () => {
    for (const type of [
      "double",
      "int8",
      "string",
      "cdouble",
      "double[]",
      "double[*]",
      "int8{list}",
      "int8{int32}",
      "int8{string}",
      "a.B",
    ]) {
      expect(placeholder(type)).not.toBe("");
    }
  });
});

describe("shown values", () => {
  it("shows numbers shortly and without losing whole ones", () => {
    expect(formatNumber(123456789)).toBe("123456789");
    expect(formatNumber(1 / 3)).toBe("0.333333");
    expect(formatNumber(0.1 + 0.2)).toBe("0.3");
    expect(formatNumber(1.5e-9)).toBe("1.5000e-9");
    expect(formatNumber(NaN)).toBe("NaN");
  });
  it("shows nested values, and no more than a bounded part of large ones", () => {
    expect(formatValue({ x: 1, label: "a" })).toBe('x: 1\nlabel: "a"');
    expect(formatValue({ a: { b: 1, c: 2 } })).toBe("a: {b: 1, c: 2}");
    expect(formatValue([{ x: 1, note: "n".repeat(80) }])).toBe(
      `[\n  {\n    x: 1\n    note: "${"n".repeat(80)}"\n  }\n]`,
    );
    expect(formatValue(Uint8Array.of(1, 2))).toBe("[1, 2]");
    const uuid = { ["uuid_bytes"]: Uint8Array.from({ length: 16 }, (_, i) => i * 17) };
    expect(formatValue({ id: uuid })).toBe("id: 00112233-4455-6677-8899-aabbccddeeff");
    expect(formatValue({ ["uuid_bytes"]: Uint8Array.of(1) })).toBe("uuid_bytes: [1]");
    expect(formatValue(new Map([[0, "front"]]))).toBe('0: "front"');
    expect(formatValue({ dims: [2, 1], data: Float64Array.of(1, 2) })).toBe("2 × 1 [1, 2]");
    expect(formatValue(new Uint8Array(1_000_000))).toMatch(/… 999984 more\]$/);
    expect(formatValue("x".repeat(10_000)).length).toBeLessThan(450);
    expect(formatValue(9007199254740993n)).toBe("9007199254740993");
    expect(formatValue(null)).toBe("null");
    expect(formatValue({ re: 1.5, im: -2 })).toBe("1.5 - 2i");
  });
  it("ends on values that contain themselves", () => {
    const loop: Record<string, unknown> = {};
    loop["self"] = loop;
    expect(formatValue(loop)).toContain("…");
  });
  it("shows bytes", () => {
    expect(formatHex(Uint8Array.of(1, 255, 16), 2)).toBe("01 ff …");
  });
});

describe("readings for a plot", () => {
  it("finds numbers by their place in the value", () => {
    expect(readingsOf(5)).toEqual([{ label: "", value: 5 }]);
    expect(readingsOf({ pose: { x: 1, y: 2 }, on: true })).toEqual([
      { label: "pose.x", value: 1 },
      { label: "pose.y", value: 2 },
      { label: "on", value: 1 },
    ]);
    expect(readingsOf(Float64Array.of(1, 2)).map((r) => r.label)).toEqual(["[0]", "[1]"]);
    expect(readingsOf(7n)).toEqual([{ label: "", value: 7 }]);
  });
  it("leaves out data and text, and stops at six", () => {
    expect(readingsOf({ image: new Uint8Array(1000), name: "x" })).toEqual([]);
    expect(readingsOf({ a: 1, b: 2, c: 3, d: 4, e: 5, f: 6, g: 7 })).toHaveLength(6);
  });
});
