// What a service definition declares, at run time: values of constants and enums, schemas, documentation.
import { settle, TestService } from "./service.js";
import type { NamedObject } from "./service.js";

const library = `service test.library
stdver 0.10
enum Unit
  metre = 1,
  mile
end
struct Empty
end`;

const old = `service test.old
option constant int32 LIMIT 5
object Thing
  option constant string NAME "thing"
end`;

const definition = `## What it is for.
service test.definition
stdver 0.10
import test.library
## How fast it may go.
constant double LIMIT 2.5
constant int32 HEX -0x10
constant int32 PLUS +0x10
constant single TENTH 0.1
constant single ODD 16777217
constant int64 LEAST -9223372036854775808
constant uint64[] MORE {+0x10, 3}
constant int64 HUGE 9223372036854775807
constant uint64[] BIG {1, 18446744073709551615}
constant int16[3] THREE {-1, 0x10, 3}
constant double[] NONE {}
constant string TEXT "a, {\\"quoted\\"} \\u00e9"
constant struct BOTH {first: LIMIT, second: INNER}
constant struct INNER {text: TEXT}
exception Jammed
## What it does.
enum Mode
  stop = 0,
  ## Full speed.
  run = -3
end
struct Pose
  ## In metres.
  field double x
  field Mode{list} modes
end
namedarray Vector
  field double constructor
end
object Base
end
object Robot
  implements Base
  constant uint8 LIMIT 7
  property Mode mode
  property Pose pose
  function Mode echo(Mode mode)
end`;

let robot: NamedObject;
const start = async (definitions = [library, definition], root = "test.definition.Robot") => {
  const service = await TestService.start({ definitions, root });
  robot = await service.connect();
};
afterEach(async () => {
  await robot.$.close();
  await settle();
});

it("gives constants as values of their types", async () => {
  await start();
  const { constants, name, documentation } = await robot.$.definition();
  expect(name).toBe("test.definition");
  expect(documentation).toBe("What it is for.");
  expect({ ...constants }).toEqual({
    LIMIT: 2.5,
    HEX: -16,
    PLUS: 16,
    TENTH: 0.10000000149011612,
    ODD: 16777216,
    LEAST: -9223372036854775808n,
    MORE: BigUint64Array.of(16n, 3n),
    HUGE: 9223372036854775807n,
    BIG: BigUint64Array.of(1n, 18446744073709551615n),
    THREE: Int16Array.of(-1, 16, 3),
    NONE: new Float64Array(),
    TEXT: 'a, {"quoted"} é',
    BOTH: { first: 2.5, second: { text: 'a, {"quoted"} é' } },
    INNER: { text: 'a, {"quoted"} é' },
  });
});

it("gives enums as numbers by name; members take both", async () => {
  await start();
  const { enums } = await robot.$.definition();
  expect(enums.Mode).toEqual({ stop: 0, run: -3 });
  await robot.mode!.set(enums.Mode?.run);
  expect(await robot.mode!.get()).toBe(-3);
  await robot.mode!.set("stop");
  expect(await robot.mode!.get()).toBe(0);
  expect(await robot.echo!("run")).toBe(-3);
});

it("gives the schemas of types", async () => {
  await start();
  const { types, exceptions } = await robot.$.definition();
  expect(Object.keys(types)).toEqual(["Pose", "Vector", "Base", "Robot"]);
  expect(types.Pose).toMatchObject({ name: "test.definition.Pose", kind: "struct", implements: [] });
  expect(types.Pose?.members[0]).toMatchObject({ kind: "field", type: "double", documentation: "In metres." });
  expect(types.Pose?.members[1]?.type).toBe("Mode{list}");
  expect(types.Vector?.members.map((field) => field.name)).toEqual(["constructor"]);
  expect(types.Robot).toMatchObject({ kind: "object", implements: ["test.definition.Base"] });
  expect({ ...types.Robot?.constants }).toEqual({ LIMIT: 7 });
  expect(types.Robot?.members).toEqual(robot.$.members);
  expect(exceptions).toEqual(["test.definition.Jammed"]);
});

it("keeps the documentation of what is only a value", async () => {
  await start();
  const { notes } = await robot.$.definition();
  expect([...notes]).toEqual([
    ["LIMIT", "How fast it may go."],
    ["Mode", "What it does."],
    ["Mode.run", "Full speed."],
  ]);
});

it("gives other definitions by name, and says which it does not know", async () => {
  await start();
  expect((await robot.$.definition("test.library")).enums).toEqual({ Unit: { metre: 1, mile: 2 } });
  await expect(robot.$.definition("test.other")).rejects.toThrow('definition: "test.other" is not known');
  await robot.$.close();
  await expect(robot.$.definition()).rejects.toThrow("the session is closed");
});

it("takes constants of the old form", async () => {
  await start([old], "test.old.Thing");
  const { constants, types } = await robot.$.definition();
  expect([constants.LIMIT, types.Thing?.constants.NAME]).toEqual([5, "thing"]);
});

it("gives the constants of an object's type and of its definition for short", async () => {
  await start();
  const constants = await robot.$.constants;
  expect(constants["LIMIT"]).toBe(7); // the type's own
  expect([constants["HEX"], constants["TEXT"]]).toEqual([-16, 'a, {"quoted"} \u00e9']);
  expect("constructor" in constants).toBe(false);
  await robot.$.close();
  await expect(robot.$.constants).rejects.toThrow("the session is closed");
});
