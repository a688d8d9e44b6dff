// How often reading a value crosses between JavaScript and WebAssembly: a number that does not grow with its fields.
import { JsReader } from "../../wasm-client/ts/js_reader.js";
import { connect, TestService } from "./service.js";
import type { NamedObject } from "./service.js";

const definition = `service test.crossings
stdver 0.10
struct State
  field double x
  field double y
  field single speed
  field int32 count
  field uint8 mode
  field bool is_ready
  field int64 ticks
  field string label
end
namedarray Vector3
  field double x
  field double y
  field double z
end
struct Wide
${Array.from({ length: 1100 }, (_, index) => `  field double f${index}`).join("\n")}
  field double ${"long".repeat(20)}
end
object Root
  property Wide wide
  property State state
  property Vector3 position
  property Vector3[] path
  property double[3] joints
  wire State states [readonly]
  function void publish_states(State value)
end`;

const state = {
  x: 1.5,
  y: -2,
  speed: 0.5,
  count: -7,
  mode: 200,
  is_ready: true,
  ticks: 2n ** 53n + 1n,
  label: "dock ü",
};
const position = { x: 1, y: 2, z: 3 };

/** What was called since it was last emptied, by both sides. */
const calls: string[] = [];
/** Of JavaScript's side. */
let imported: Set<string>;
let robot: NamedObject;

beforeEach(async () => {
  const service = await TestService.start({ definitions: [definition], root: "test.crossings.Root" });
  const counted = <T extends object>(functions: T): T =>
    Object.fromEntries(
      Object.entries(functions).map(([name, each]: [string, unknown]) => [
        name,
        typeof each === "function"
          ? (...args: unknown[]): unknown => (calls.push(name), (each as (...all: unknown[]) => unknown)(...args))
          : each,
      ]),
    ) as T;
  const { instantiate } = WebAssembly;
  vi.spyOn(WebAssembly, "instantiate").mockImplementation((async (
    code: WebAssembly.Module,
    imports: { js: Record<string, WebAssembly.ImportValue> },
  ) => {
    imported = new Set(Object.keys(imports.js));
    const { exports } = await instantiate(code, { js: counted(imports.js) });
    return { exports: counted(exports) };
  }) as unknown as typeof instantiate);
  robot = await connect("ws://test.example/?service=test", { transport: service.transport });
  vi.restoreAllMocks();
});

afterEach(() => robot.$.close());

/** What is called from the poll for an event to its end, for each event that comes while `read` waits. */
async function eventsOf<T>(read: () => Promise<T>): Promise<{ result: T; events: string[][] }> {
  await read(); // names are told once
  calls.length = 0;
  const result = await read();
  const events: string[][] = [];
  calls.forEach((name, at) => {
    if (name !== "poll_event") return;
    const end = calls.findIndex((other, from) => from > at && !imported.has(other));
    events.push(calls.slice(at, end));
  });
  return { result, events: events.filter((each) => each.length > 1) };
}

it.each([
  ["a struct of eight scalars", "state", state],
  ["an element of a named array", "position", position],
  ["an array of named arrays", "path", [position, { x: 4, y: 5, z: 6 }]],
  ["a small array", "joints", new Float64Array([0.1, 0.2, 0.3])],
])("crosses twice for %s", async (_, name, value) => {
  await robot[name]!.set(value);
  const { result, events } = await eventsOf(() => robot[name]!.get());
  expect(result).toEqual(value);
  expect(events).toEqual([["poll_event", "build"]]);
});

it("crosses twice for a value of a wire", async () => {
  const wire = await robot["states"]!.connect();
  const values = wire[Symbol.asyncIterator]();
  const { result, events } = await eventsOf(async () => {
    const next = values.next();
    await robot["publish_states"]!(state);
    return (await next).value as unknown;
  });
  expect(result).toEqual(state);
  // The value, and the answer of the function that made the service send it.
  expect(events).toEqual([
    ["poll_event", "build"],
    ["poll_event", "build"],
  ]);
});

it("reads names beyond those that it remembers, and long ones", async () => {
  const wide = Object.fromEntries(Array.from({ length: 1100 }, (_, index) => [`f${index}`, index]));
  wide["long".repeat(20)] = -1;
  await robot["wide"]!.set(wide);
  for (let i = 0; i < 2; ++i) expect(await robot["wide"]!.get()).toEqual(wide);
  await robot["state"]!.set(state);
  expect(await robot["state"]!.get()).toEqual(state);
});

it("takes no name for another where the value that told it was not read", () => {
  const reader = new JsReader(() => null);
  const name = (code: number, text = ""): Uint8Array<ArrayBuffer> =>
    Uint8Array.of(8, code & 0xff, code >> 8, text.length, 0, 0, 0, ...new TextEncoder().encode(text));
  expect(reader.read(name(0x8005, "speed"), 0)).toBe("speed");
  expect(reader.read(name(5), 0)).toBe("speed");
  expect(() => reader.read(name(4), 0)).toThrow("the name 4 is missing");
  expect(reader.read(name(0xffff, "long"), 0)).toBe("long");
});
