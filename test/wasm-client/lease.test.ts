// Leases at a service that knows none, and calls that are sent past what waits. With a gateway: test/e2e/tests/lease.spec.ts.
import { readdirSync, readFileSync } from "node:fs";
import { lease } from "../../wasm-client/dist/node.js";
import type { RemoteObject } from "../../wasm-client/dist/node.js";
import { failure, TestService } from "./service.js";

const definition = `service test.lease
stdver 0.10
object Root
  property double speed
  function double drive(double speed)
  function string who()
  function int32{generator} count(int32 last)
end`;

let robot: RemoteObject;
beforeEach(async () => {
  const service = await TestService.start({ definitions: [definition], root: "test.lease.Root" });
  robot = await service.connect();
});
afterEach(async () => {
  vi.unstubAllGlobals();
  await robot.$.close();
});

it("says where there is no gateway that gives any", async () => {
  const error = await failure(lease(robot, { deadman: 300 }));
  expect([error.name, error.message]).toEqual([
    "RobotRaconteur.NotImplementedError",
    "there is no gateway that gives leases: the device is used without one",
  ]);
  expect(await robot["drive"]!(2)).toBe(2);
});

it("has bounds for the dead-man's time", async () => {
  for (const deadman of [49, 60_001, Number.NaN, -1])
    expect((await failure(lease(robot, { deadman }))).message).toBe(`deadman ${deadman}: expected 50 to 60000 ms`);
});

it("is not for a page that nobody looks at", async () => {
  vi.stubGlobal("document", { visibilityState: "hidden" });
  expect((await failure(lease(robot))).message).toBe("this page is hidden: it can hold no lease");
});

it("calls functions urgently, with arguments and options as otherwise", async () => {
  expect(Object.keys(robot.$.urgent)).toEqual(["drive", "who", "count"]);
  expect(await robot.$.urgent["drive"]!(3, { timeout: 1000 })).toBe(3);
  expect((await failure(Promise.resolve(robot.$.urgent["drive"]!(1, 2, 3)))).name).toBe(
    "RobotRaconteur.InvalidArgument",
  );
  expect("speed" in robot.$.urgent).toBe(false);
});

it("loads when it is used, and not before", () => {
  const dist = new URL("../../wasm-client/dist/", import.meta.url);
  for (const file of readdirSync(dist).filter((name) => name.endsWith(".js")))
    expect(readFileSync(new URL(file, dist), "utf8"), file).not.toMatch(/from "\.\/lease/);
});
