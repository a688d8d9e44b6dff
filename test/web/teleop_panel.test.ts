// Driving over an outage: what the device is told to rest by when it is back.
import { clear, find, press, settle, show, text } from "./shown";
import { memberOf } from "./members";
import { ErrorCode, RobotRaconteurError } from "../../wasm-client/dist/index.js";
import type { PanelProps } from "../../web/src/panels/panel";
import TeleopPanel from "../../web/src/panels/teleop_panel";
import { OwnLocks } from "../../web/src/robot/own_locks";
import type { Member, Remote } from "../../web/src/robot/remote";
import { Definitions } from "../../web/src/values/definitions";

beforeEach(() => void vi.stubGlobal("navigator", window.navigator));
afterEach(() => {
  clear();
  vi.unstubAllGlobals();
});

const moveOf = (...names: string[]): Member[] => [
  { ...memberOf("function", "void", "move"), parameters: names.map((name) => ({ name, type: "double" })) },
];

/** Gives no leases, and answers no command. */
const robotOf = () => {
  const error = Object.create(RobotRaconteurError.prototype) as RobotRaconteurError;
  const never = () => new Promise(() => undefined);
  return {
    path: "Robot",
    controls: new Map(),
    locks: new OwnLocks(),
    lease: () => Promise.reject(Object.assign(error, { code: ErrorCode.NotImplementedError })),
    call: vi.fn(never),
    urgent: vi.fn(never),
  };
};

test("a rest that somebody asked for is passed on by the gateway where the device does not answer it", async () => {
  const robot = robotOf();
  const error = Object.create(RobotRaconteurError.prototype) as RobotRaconteurError;
  const silent = Object.assign(error, { code: ErrorCode.RequestTimeout });
  robot.urgent.mockRejectedValue(silent);
  const stopWithout = vi.fn(() => Promise.resolve("passed on"));
  show(TeleopPanel, {
    object: robot as unknown as Remote,
    stopWithout,
    members: moveOf("speed"),
    definitions: new Definitions([]),
    scope: "",
    place: { device: "usb:d", service: "s", object: "" },
    settings: { axes: [{ stick: "left-y", path: "speed", scale: 3, deadZone: 0 }] },
    change: () => undefined,
  } as unknown as PanelProps);
  await settle();
  await press("Rest");
  expect(stopWithout).toHaveBeenCalledWith(silent);
  expect(text()).toContain("passed on");
  expect(robot.urgent).toHaveBeenCalledOnce();
});

test("each parameter rests at its own neutral value, wherever it stands by now", async () => {
  const [before, after] = [robotOf(), robotOf()];
  const update = show(TeleopPanel, {
    object: before as unknown as Remote,
    members: moveOf("speed", "radius"),
    definitions: new Definitions([]),
    scope: "",
    place: { device: "usb:d", service: "s", object: "" },
    settings: {
      axes: [{ stick: "left-y", path: "speed", scale: 3, deadZone: 0 }],
      neutral: { speed: "0", radius: "1000" },
    },
    change: () => undefined,
  } as unknown as PanelProps);
  await settle();
  find(".teleop-pad").dispatchEvent(new KeyboardEvent("keydown", { code: "KeyW", bubbles: true }));
  await vi.waitFor(() => expect(before.call).toHaveBeenCalledWith("move", [3, 1000], expect.anything()));
  await update({ object: null });
  expect(before.urgent).toHaveBeenCalledWith("move", [0, 1000], expect.anything());
  await update({ object: after as unknown as Remote, members: moveOf("radius", "speed") });
  expect(after.urgent).toHaveBeenCalledWith("move", [1000, 0], expect.anything());
  expect(after.call).not.toHaveBeenCalled();
});
