// Which numbers of a member a plot offers, and draws where none are chosen.
import { clear, find, settle, show } from "./shown";
import { memberOf } from "./members";
import type { PanelProps } from "../../web/src/panels/panel";
import PlotPanel from "../../web/src/panels/plot_panel";
import type { Remote } from "../../web/src/robot/remote";
import { Definitions } from "../../web/src/values/definitions";

// By its file: the tests lie where no package is found.
vi.mock("../../web/node_modules/uplot/dist/uPlot.cjs.js", () => ({
  default: class {
    cursor = {};
    root = document.createElement("div");
    setData(): void {}
    setSize(): void {}
    setLegend(): void {}
    destroy(): void {}
  },
}));

beforeEach(() => {
  vi.useFakeTimers({ toFake: ["performance"] });
  const { ResizeObserver, IntersectionObserver } = window;
  vi.stubGlobal("ResizeObserver", ResizeObserver);
  vi.stubGlobal("IntersectionObserver", IntersectionObserver);
  vi.stubGlobal("getComputedStyle", window.getComputedStyle.bind(window));
});
afterEach(() => {
  clear();
  vi.unstubAllGlobals();
  vi.useRealTimers();
});

/** A member in the hands of the test. */
function makeWire() {
  let tell: (value: unknown) => void = () => undefined;
  const wire = async function* () {
    for (;;) yield await new Promise((resolve) => (tell = resolve));
  };
  const say = async (value: unknown): Promise<void> => {
    tell(value);
    await settle();
  };
  return { object: { wire } as unknown as Remote, say };
}

test("numbers that a member did not have at first are found later", async () => {
  const { object, say } = makeWire();
  show(PlotPanel, {
    object,
    members: [memberOf("wire", "RobotState", "robot_state")],
    definitions: new Definitions([]),
    scope: "",
    settings: {},
    change: () => undefined,
  } as unknown as PanelProps);
  await settle();
  const series = () => find(".plot-canvas").getAttribute("aria-label");
  await say({ trajectory_running: false, joint_position: new Float64Array() });
  expect(series()).toBe("Plot of trajectory_running");
  const full = { trajectory_running: false, joint_position: new Float64Array(2) };
  await say(full);
  vi.advanceTimersByTime(1_000);
  await say(full);
  expect(series()).toBe("Plot of trajectory_running, joint_position[0], joint_position[1]");
  vi.advanceTimersByTime(1_000);
  await say({ trajectory_running: false, joint_position: new Float64Array(1) });
  expect(series()).toBe("Plot of trajectory_running, joint_position[0], joint_position[1]");
});
