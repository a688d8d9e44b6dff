// Calls as code: curl, JavaScript, Python.
import { definitions, scope } from "./arm";
import { memberOf } from "./members";
import { asCode } from "../../web/src/panels/code";
import { draftOf, jsonOf, valueOf } from "../../web/src/values/draft";

test("code quotes what comes from the device", () => {
  const member = { ...memberOf("function", "void", "Drive"), parameters: [{ name: "__proto__", type: "string" }] };
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
  const member = memberOf("property", "varvalue", "goal");
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
  const member = memberOf("property", "uint64", "count");
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
