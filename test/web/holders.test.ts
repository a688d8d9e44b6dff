// Leases and locks, as the gateway's own service lists them.
import { isAbout, readHolders } from "../../web/src/live/holders";

test("those of the device that are held now", () => {
  const lease = { device: "arm", path: "Arm", user: "vera", deadman: 300, left: 120, held: true };
  const lock = { device: "arm", path: "Arm.tool", user: "", kind: "client" };
  expect(readHolders([lease, { ...lease, held: false }, { ...lease, device: "other" }, null], [lock], "arm")).toEqual([
    { what: "lease", path: "Arm", user: "vera", deadmanMs: 300, leftMs: 120 },
    { what: "client", path: "Arm.tool", user: "", deadmanMs: 0, leftMs: null },
  ]);
  expect(readHolders(undefined, "none", "arm")).toEqual([]);
});

test("an object's own, and those above and below it", () => {
  const about = (own: string) => ["Arm", "Arm.tool", "Arm.tools[1]", "Arms"].filter((path) => isAbout(path, own));
  expect(about("Arm")).toEqual(["Arm", "Arm.tool", "Arm.tools[1]"]);
  expect(about("Arm.tool")).toEqual(["Arm", "Arm.tool"]);
});
