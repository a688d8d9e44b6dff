// Models of robots in the 3-D panel: with joints, without any, and with joints of which nothing is known.
import { clear, settle, show, text } from "./shown";
import { Window } from "happy-dom";
import { memberOf } from "./members";
import type { PanelProps } from "../../web/src/panels/panel";
import ScenePanel from "../../web/src/panels/scene_panel";
import type { Remote } from "../../web/src/robot/remote";
import { Definitions } from "../../web/src/values/definitions";

const { drawn } = vi.hoisted(() => ({ drawn: vi.fn() }));
vi.mock("../../web/src/panels/scene", () => ({
  Picture: class {
    show = drawn;
    showPoints(): void {}
    colour(): void {}
    dispose(): void {}
  },
}));
vi.stubGlobal("DOMParser", new Window().DOMParser);
vi.stubGlobal("getComputedStyle", window.getComputedStyle.bind(window));

beforeEach(() => void vi.useFakeTimers({ toFake: ["setInterval", "performance"] }));
afterEach(() => {
  clear();
  drawn.mockClear();
  vi.useRealTimers();
});

const SHOULDER = { joint_identifier: { name: "shoulder" }, default_units: 2 };
const body = '<visual><geometry><sphere radius="0.1"/></geometry></visual>';
const still = `<link name="base">${body}</link>`;
const moved = `${still}<link name="arm"/><joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/></joint>`;

/** A panel with that model of a robot whose info is that, and which says where its joints are. */
function showModel(links: string, info: () => Promise<unknown>, ...more: PanelProps["members"]) {
  let tell: (value: unknown) => void = () => undefined;
  const wire = async function* () {
    for (;;) yield await new Promise((resolve) => (tell = resolve));
  };
  show(ScenePanel, {
    object: { wire, get: info } as unknown as Remote,
    members: [memberOf("wire", "RobotState", "robot_state"), ...more],
    definitions: new Definitions([]),
    scope: "",
    settings: { model: "/file", file: "arm.urdf", urdf: `<robot name="arm">${links}</robot>` },
    change: () => undefined,
  } as unknown as PanelProps);
  return async (...positions: number[]): Promise<void> => {
    await settle();
    tell({ joint_position: Float64Array.from(positions) });
    await settle();
    vi.advanceTimersByTime(100);
    await settle();
  };
}

const robotInfo = memberOf("property", "RobotInfo", "robot_info");
const infoOf =
  (...joints: unknown[]) =>
  () =>
    Promise.resolve<unknown>({ joint_info: joints });
/** How many shapes stand in the picture. */
const bodies = () => (drawn.mock.lastCall?.[2] as unknown[]).length;

test("a model without joints stands still, and it is said that it has none of the robot's", async () => {
  const say = showModel(still, infoOf(SHOULDER), robotInfo);
  await say(0.25);
  expect([bodies(), text()]).toEqual([1, expect.stringContaining("none of the robot's joints: shoulder")]);
});

test("a robot without joints has its model", async () => {
  const say = showModel(still, infoOf(), robotInfo);
  await say();
  expect([bodies(), text()]).toEqual([1, expect.not.stringContaining("none of the robot's joints")]);
});

test("a model is drawn for what is no robot", async () => {
  const info = vi.fn();
  const say = showModel(moved, info);
  await say();
  expect([bodies(), info.mock.calls]).toEqual([1, []]);
});

test("a model is not drawn until it is known where its joints are", async () => {
  const say = showModel(moved, infoOf(SHOULDER), robotInfo);
  await say();
  expect(bodies()).toBe(0);
  await say(0.25);
  expect([bodies(), text()]).toEqual([1, expect.not.stringContaining("none of the robot's joints")]);
});

test("a model is not drawn while the robot has not said which joints it has", async () => {
  const say = showModel(moved, () => Promise.reject(new Error("not yet")), robotInfo);
  await say(0.25);
  expect([bodies(), text()]).toEqual([0, expect.stringContaining("not yet")]);
});
