// Poses in values, and chains of joints: what the 3-D panel shows.
import { chainsOf, framesIn, posesOf } from "../../web/src/values/frames";

const still = { w: 1, x: 0, y: 0, z: 0 };
const half = Math.SQRT1_2;
const leftTurn = { w: half, x: 0, y: 0, z: half };
const at = (x: number, y: number, z: number) => ({ x, y, z });
const rounded = (numbers: readonly number[] | undefined) => numbers?.map((each) => Math.round(each * 1e6) / 1e6 + 0);

const info = (units: number, type = 1) => ({
  joint_info: [
    { joint_type: type, default_units: units },
    { joint_type: 1, default_units: units },
  ],
  chains: [
    {
      kin_chain_identifier: { name: "arm" },
      H: [at(0, 0, 1), at(0, 0, 1)],
      P: [at(0, 0, 0.1), at(0.5, 0, 0), at(0.4, 0, 0)],
      joint_numbers: Uint32Array.of(0, 1),
      flange_pose: { orientation: still, position: at(0, 0, 0) },
    },
  ],
});
const flangeOf = (of: unknown, positions: number[]) => {
  const chain = chainsOf(of)[0];
  return chain && rounded(posesOf(chain, positions).at(-1)?.at);
};

it("finds poses and transforms anywhere in a value, by their path", () => {
  const value = {
    seqno: 3n,
    tcp: [{ orientation: still, position: at(1, 2, 3) }],
    base: { rotation: leftTurn, translation: at(4, 5, 6) },
    flat: { orientation: Math.PI / 2, position: { x: 7, y: 8 } },
  };
  const frames = framesIn(value);
  expect(frames.map(({ name, pose }) => [name, pose.at])).toEqual([
    ["tcp[0]", [1, 2, 3]],
    ["base", [4, 5, 6]],
    ["flat", [7, 8, 0]],
  ]);
  expect(rounded(frames[2]?.pose.turn)).toEqual(rounded([half, 0, 0, half]));
});

it("puts a frame that has a name into that of its parent, and ends where parents go in a circle", () => {
  const named = (parent: string, frame: string, pose: object) => ({
    parent_frame: { name: parent },
    frame: { name: frame },
    pose,
  });
  const frames = framesIn([
    named("cart", "camera", { orientation: still, position: at(1, 0, 0) }),
    named("room", "cart", { orientation: leftTurn, position: at(10, 0, 0) }),
    named("b", "a", { orientation: still, position: at(1, 0, 0) }),
    named("a", "b", { orientation: still, position: at(1, 0, 0) }),
  ]);
  expect(frames.map(({ name, pose }) => [name, rounded(pose.at)])).toEqual([
    ["camera", [10, 1, 0]],
    ["cart", [10, 0, 0]],
    ["a", [2, 0, 0]],
    ["b", [2, 0, 0]],
  ]);
});

it.each([
  ["no number", { orientation: still, position: at(NaN, 0, 0) }],
  ["no finite one", { orientation: { ...still, w: Infinity }, position: at(0, 0, 0) }],
  ["nothing", null],
  ["a view of bytes", new Float64Array(3)],
  ["inherited fields", Object.create({ orientation: still, position: at(0, 0, 0) }) as unknown],
])("takes %s for no pose", (_, value) => expect(framesIn({ value })).toEqual([]));

it("gives a quaternion of length 1, also for one that nobody has filled in", () => {
  const turnOf = (w: number) =>
    framesIn({ orientation: { ...still, w }, position: at(0, 0, 0) }).map(({ pose }) => pose.turn);
  expect(turnOf(2)).toEqual([[1, 0, 0, 0]]);
  expect(turnOf(0)).toEqual([[1, 0, 0, 0]]);
});

it("follows a chain of turning joints to its flange, in radians and in degrees", () => {
  expect(flangeOf(info(2), [0, 0])).toEqual([0.9, 0, 0.1]);
  expect(flangeOf(info(2), [Math.PI / 2, -Math.PI / 2])).toEqual([0.4, 0.5, 0.1]);
  expect(flangeOf(info(3), [90, -90])).toEqual([0.4, 0.5, 0.1]);
});

it("follows a joint that slides along its axis", () => expect(flangeOf(info(1, 3), [0.2, 0])).toEqual([0.9, 0, 0.3]));

it("leaves a chain out whose lists don't fit together", () => {
  const broken = info(2);
  broken.chains[0]?.P.pop();
  expect(chainsOf(broken)).toEqual([]);
  expect(chainsOf({ chains: null })).toEqual([]);
});
