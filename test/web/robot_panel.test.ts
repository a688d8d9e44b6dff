// Panels of a standard robot over outages: nothing of the robot before is taken for that of the one that there is now.
import { button, clear, find, show, text } from "./shown";
import { memberOf } from "./members";
import type { PanelProps } from "../../web/src/panels/panel";
import RobotPanel from "../../web/src/panels/robot_panel";
import TrajectoryPanel from "../../web/src/panels/trajectory_panel";
import { OwnLocks } from "../../web/src/robot/own_locks";
import type { Remote } from "../../web/src/robot/remote";
import { UnderWay } from "../../web/src/robot/under_way";
import { Definitions } from "../../web/src/values/definitions";

beforeEach(() => void vi.useFakeTimers());
afterEach(() => {
  clear();
  vi.useRealTimers();
});

const SCOPE = "com.robotraconteur.robotics.robot";
const DEFINITIONS = new Definitions([`service ${SCOPE}\nenum RobotCommandMode\nhalt = 0,\njog = 1\nend\n`]);
const PERIOD_MS = 100;
const JOINT = {
  joint_identifier: { name: "shoulder" },
  joint_limits: { lower: -1, upper: 1, velocity: 2, reduced_velocity: 0.5 },
  default_units: 2,
};
const INFO = { joint_info: [JOINT] };

/** A robot that is in jog mode, and says so regularly, so many times. */
const robotOf = (info: () => Promise<unknown>, times = Infinity, positions = [0.25]) =>
  ({
    path: "Robot",
    controls: new Map(),
    locks: new OwnLocks(),
    underWay: new UnderWay(),
    get: vi.fn(info),
    async *wire(_: string, signal: AbortSignal) {
      for (let said = 0; !signal.aborted; ++said) {
        if (said === times) await new Promise(() => undefined);
        yield {
          command_mode: 1,
          operational_mode: 0,
          controller_state: 0,
          joint_position: new Float64Array(positions),
        };
        await new Promise((resolve) => setTimeout(resolve, PERIOD_MS));
      }
    },
  }) as unknown as Remote;

const members = [
  memberOf("wire", "RobotState", "robot_state"),
  memberOf("function", "void", "jog_joint"),
  memberOf("function", "TrajectoryStatus{generator}", "execute_trajectory"),
];

async function showPanel(panel: typeof RobotPanel, object: Remote) {
  const update = show(panel, {
    object,
    reach: object,
    members,
    definitions: DEFINITIONS,
    scope: SCOPE,
    place: { device: "usb:d", service: "s", object: "" },
    settings: { waypoints: [{ seconds: 2, positions: [0.5] }] },
    change: () => undefined,
  } as unknown as PanelProps);
  await vi.advanceTimersByTimeAsync(1_000);
  return async (next: Remote | null): Promise<void> => {
    void update({ object: next, reach: next });
    await vi.advanceTimersByTimeAsync(900);
  };
}

const jogForward = () => find<HTMLButtonElement>(".jog-button[aria-label$=forward]");

describe("limits", () => {
  const silent = () => robotOf(() => Promise.reject(new Error("not yet")));
  const known = () => robotOf(() => Promise.resolve(INFO));

  test("of the robot before are not jogged by", async () => {
    const reconnect = await showPanel(RobotPanel, known());
    expect(text()).toContain("shoulder");
    expect(jogForward().disabled).toBe(false);
    await reconnect(null);
    expect(text()).toContain("shoulder"); // what was known, marked as old
    await reconnect(silent());
    expect(text()).toContain("not yet");
    expect([jogForward().disabled, text().includes("shoulder")]).toEqual([true, false]);
  });

  test("of the robot before check no trajectory", async () => {
    const reconnect = await showPanel(TrajectoryPanel, known());
    expect(button("Run").disabled).toBe(false);
    await reconnect(null);
    await reconnect(silent());
    expect(text()).toContain("not yet");
    expect([button("Run").disabled, text().includes("shoulder")]).toEqual([true, false]);
  });

  test("that could not be read are asked for again", async () => {
    const info = vi.fn(() => Promise.resolve<unknown>(INFO)).mockRejectedValueOnce(new Error("not yet"));
    await showPanel(RobotPanel, robotOf(info));
    await vi.advanceTimersByTimeAsync(1_000);
    expect(info).toHaveBeenCalledTimes(2);
    expect([jogForward().disabled, text().includes("not yet")]).toEqual([false, false]);
  });
});

describe("what a robot said before an outage", () => {
  const known = () => robotOf(() => Promise.resolve(INFO));
  const pressed = () => ["Halt", "Jog"].filter((name) => button(name).getAttribute("aria-pressed") === "true");

  test("is marked as old, and no mode is shown as chosen", async () => {
    const reconnect = await showPanel(RobotPanel, known());
    const isMarked = () => [".robot-words", ".joints"].map((each) => find(each).classList.contains("is-stale"));
    expect([pressed(), isMarked()]).toEqual([["Jog"], [false, false]]);
    await reconnect(null);
    expect([pressed(), isMarked()]).toEqual([[], [true, true]]);
    await reconnect(known());
    expect([pressed(), isMarked()]).toEqual([["Jog"], [false, false]]);
  });

  test("is no place for a waypoint", async () => {
    const reconnect = await showPanel(TrajectoryPanel, known());
    const isOff = () => ["Here 1", "Add where the robot is"].map((name) => button(name).disabled);
    expect(isOff()).toEqual([false, false]);
    await reconnect(null);
    expect(isOff()).toEqual([true, true]);
    await reconnect(known());
    expect(isOff()).toEqual([false, false]);
  });

  test("is no place for a waypoint where it says nothing any more", async () => {
    await showPanel(
      TrajectoryPanel,
      robotOf(() => Promise.resolve(INFO), 5),
    );
    expect(text()).toContain("Stale");
    expect(button("Here 1").disabled).toBe(true);
  });
});

test("a robot without joints has its state and its modes, and nothing to be jogged or moved", async () => {
  const bare = () => robotOf(() => Promise.resolve({ joint_info: null, chains: null }), Infinity, []);
  await showPanel(RobotPanel, bare());
  expect([find(".robot-words").textContent, button("Jog").disabled]).toEqual([expect.stringContaining("jog"), false]);
  expect(document.querySelectorAll(".jog-button")).toHaveLength(0);
  clear();
  await showPanel(TrajectoryPanel, bare());
  expect([button("Run").disabled, document.querySelector("[role=alert]:not([hidden])")]).toEqual([true, null]);
});
