// Where the protocol core comes from, and when it is loaded.
import { readFile } from "node:fs/promises";
import type * as client from "../../wasm-client/dist/node.js";
import { ErrorCode } from "../../wasm-client/dist/node.js";
import { failure, TestService } from "./service.js";

const definition = "service test.init\nstdver 0.10\nobject Root\n  property double speed\nend";
const core = new URL("../../wasm-client/dist/rrgate.wasm", import.meta.url);
const url = "ws://one/?service=test";

let fresh: typeof client;
let loads: string[];

beforeEach(async () => {
  vi.resetModules(); // nothing is loaded yet
  fresh = await import("../../wasm-client/dist/node.js");
  const { platform } = await import("../../wasm-client/dist/internal.js");
  const load = platform.loadWasm.bind(platform);
  loads = [];
  platform.loadWasm = (from) => (loads.push(from.pathname.split("/").at(-1) as string), load(from));
});

const start = () => TestService.start({ definitions: [definition], root: "test.init.Root" });

it("loads the core while the socket opens, and once", async () => {
  const service = await start();
  const seen: number[] = [];
  const robot = await fresh.connect(url, {
    transport: (to, listener) => (seen.push(loads.length), service.transport(to, listener)),
  });
  await robot.$.close();
  await fresh.preload();
  expect(seen).toEqual([1]);
  expect(loads).toEqual(["rrgate.wasm"]);
});

it("loads it before when it is asked to", async () => {
  await fresh.preload();
  await fresh.preload();
  expect(loads).toEqual(["rrgate.wasm"]);
});

it.each([
  ["bytes", async () => readFile(core)],
  ["a promise of bytes", () => readFile(core)],
  ["a module", async () => WebAssembly.compile(await readFile(core))],
  ["a function", async () => () => readFile(core)],
])("takes it from %s", async (_, make) => {
  fresh.init({ wasm: await make() });
  const robot = await fresh.connect(url, { transport: (await start()).transport });
  expect(robot.$.type).toBe("test.init.Root");
  expect(loads).toEqual([]);
  await robot.$.close();
});

it("takes it from another place", async () => {
  fresh.init({ wasm: new URL("./elsewhere.wasm", core) });
  const error = await failure(fresh.preload());
  expect(loads).toEqual(["elsewhere.wasm"]);
  expect(error.code).toBe(ErrorCode.SystemResourceError);
  expect(error.message).toContain("elsewhere.wasm");
});

it("has it in the script of the inline build", async () => {
  vi.resetModules();
  const inline = await import("../../wasm-client/dist/inline.js");
  const robot = await inline.connect(url, { transport: (await start()).transport });
  expect(robot.$.type).toBe("test.init.Root");
  expect(loads).toEqual([]);
  await robot.$.close();
});

it("refuses another one when it is loaded", async () => {
  await fresh.preload();
  expect(() => fresh.init({ wasm: core })).toThrow("loaded already");
});
