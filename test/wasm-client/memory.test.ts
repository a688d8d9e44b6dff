// Memories: parts of arrays, with one dimension and with more.
import { ErrorCode } from "../../wasm-client/dist/node.js";
import { failure, settle, TestService } from "./service.js";
import type { NamedObject } from "./service.js";

const definition = `service test.memory
stdver 0.10
object Root
  memory double[] line
  memory double[*] grid
  memory double[] shown [readonly]
end`;

let service: TestService;
let robot: NamedObject;

beforeEach(async () => {
  service = await TestService.start({ definitions: [definition], root: "test.memory.Root" });
  robot = await service.connect();
});
afterEach(() => robot.$.close());

it("has a length or dimensions", async () => {
  expect(await robot["line"]!.dimensions()).toEqual([10]);
  expect(await robot["grid"]!.dimensions()).toEqual([4, 3]);
});

it("is read and written in parts", async () => {
  const line = robot["line"]!;
  expect(await line.read(2, 3)).toEqual(Float64Array.of(2, 3, 4));
  await line.write(3, Float64Array.of(30, 40));
  await line.write([9], [90]);
  expect(await line.read([0], [10])).toEqual(Float64Array.of(0, 1, 2, 30, 40, 5, 6, 7, 8, 90));
  expect(await line.read(0, 0)).toEqual(new Float64Array(0));
});

it("has dimensions, the first of which runs fastest", async () => {
  const grid = robot["grid"]!;
  expect(await grid.read([1, 1], [2, 2])).toEqual({ dims: [2, 2], data: Float64Array.of(5, 6, 9, 10) });
  await grid.write([0, 2], { dims: [2, 1], data: [80, 90] });
  expect(await grid.read([0, 2], [4, 1])).toEqual({ dims: [4, 1], data: Float64Array.of(80, 90, 10, 11) });
});

it("refuses what is not within it", async () => {
  for (const reading of [
    robot["line"]!.read(8, 3),
    robot["grid"]!.read([0, 3], [1, 1]),
    robot["line"]!.write(10, [1]),
    robot["line"]!.read(-1, 1),
  ]) {
    expect((await failure(reading)).code).toBe(ErrorCode.OutOfRange);
  }
  expect((await failure(robot["shown"]!.write(0, [1]))).code).toBe(ErrorCode.ReadOnlyMember);
  expect((await failure(robot["line"]!.write(0, "text"))).code).toBe(ErrorCode.DataTypeMismatch);
  expect((await failure(robot["line"]!.read(0.5, 1))).message).toContain("position");
  expect((await failure(robot["grid"]!.read(1, 1))).code).toBe(ErrorCode.InvalidArgument);
});

it("is given up by its signal", async () => {
  const abort = new AbortController();
  service.isMute = true;
  const reading = failure(robot["line"]!.read(0, 1, { signal: abort.signal }));
  await settle();
  abort.abort(new Error("enough"));
  expect((await reading).message).toBe("enough");
  service.isMute = false;
});
