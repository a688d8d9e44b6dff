// Definitions of services as the page reads them: structs, enums, flags, what an object implements.
import { definitions, scope } from "./arm";
import { Definitions, flagNames, scopeOf } from "../../web/src/values/definitions";
import { unitOf } from "../../web/src/values/units";

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
