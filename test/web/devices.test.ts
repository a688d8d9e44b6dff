// The first page with many devices: which are wanted, in which groups, and the part of a long list that is shown.
import { readDevices } from "../../web/src/gateway/devices";
import { ANY, keepWish, recallWish, typesOf, wanted } from "../../web/src/pages/device_wish";
import { partOf } from "../../web/src/ui/window_list";

const robot = { name: "arm", type: "com.robotraconteur.robotics.robot.Robot" };
const camera = { name: "eye", type: "com.robotraconteur.imaging.Camera" };
const devices = readDevices({
  devices: [
    { name: "left", url: "rr+tcp://10.0.0.1:1/", state: "online", services: [robot] },
    { name: "right", url: "rr+tcp://10.0.0.2:1/", state: "offline", services: [robot, camera] },
    { name: "door", url: "rr+tcp://10.0.0.3:1/", node_name: "lab.door", state: "online", services: [camera] },
    { name: "new", url: "rr+tcp://10.0.0.4:1/", state: "connecting", services: [] },
  ],
});

const names = (wish: object) =>
  wanted(devices, { ...ANY, ...wish }).map(({ name, devices: members }) => [name, ...members.map((each) => each.name)]);

describe("devices that are wanted", () => {
  it("are all in the gateway's order at first", () => {
    expect(names({})).toEqual([["", "left", "right", "door", "new"]]);
  });
  it("have all words, in whatever is told of them", () => {
    expect(names({ words: "ROBOT 10.0.0.2" })).toEqual([["", "right"]]);
    expect(names({ words: "lab." })).toEqual([["", "door"]]);
    expect(names({ words: "eye" })).toEqual([["", "right", "door"]]);
    expect(names({ words: "arm lab." })).toEqual([]);
  });
  it("are of a state and of a type", () => {
    expect(names({ state: "online" })).toEqual([["", "left", "door"]]);
    expect(names({ type: camera.type, state: "offline" })).toEqual([["", "right"]]);
  });
  it("stand in groups: states in order of use, types by name", () => {
    expect(names({ group: "state" })).toEqual([
      ["online", "left", "door"],
      ["connecting", "new"],
      ["offline", "right"],
    ]);
    expect(names({ group: "type" })).toEqual([
      ["", "new"],
      [camera.type, "door"],
      [robot.type, "left", "right"],
    ]);
    expect(typesOf(devices)).toEqual([camera.type, robot.type]);
  });
  it("are remembered, and what is kept is not trusted", () => {
    let kept = "";
    const storage = { getItem: () => kept, setItem: (_: string, value: string) => void (kept = value) };
    const wish = { words: "a", state: "offline", type: "b", group: "type" } as const;
    keepWish(wish, storage);
    expect(recallWish(storage)).toEqual(wish);
    for (kept of ["", "[]", "7", '{"state":"odd","group":{}}']) expect(recallWish(storage)).toEqual(ANY);
  });
});

describe("the part of a long list that is shown", () => {
  const heights = Array<number>(5000).fill(60);
  it("is what is seen, and all others have their room", () => {
    expect(partOf(heights, 0, 600)).toEqual({ from: 0, to: 10, before: 0, behind: 4990 * 60 });
    const middle = partOf(heights, 90_030, 90_600);
    expect(middle).toEqual({ from: 1500, to: 1510, before: 90_000, behind: 3490 * 60 });
    expect(partOf(heights, 299_700, 300_300)).toMatchObject({ from: 4995, to: 5000, behind: 0 });
  });
  it("may be nothing, or past the end", () => {
    expect(partOf([], 0, 600)).toEqual({ from: 0, to: 0, before: 0, behind: 0 });
    expect(partOf([60, 60], 500, 900)).toEqual({ from: 2, to: 2, before: 120, behind: 0 });
  });
});
