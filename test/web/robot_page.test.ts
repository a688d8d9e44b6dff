// The stop of the demo robot's page where the connection to the robot has broken unnoticed.
import { clear, find, settle, show, text } from "./shown";
import { ErrorCode, RobotRaconteurError } from "../../wasm-client/dist/index.js";
import { Store } from "../../web/src/app/store";
import { session } from "../../web/src/gateway/session";
import RobotPage from "../../web/src/pages/robot_page";
import type { RobotPageProps } from "../../web/src/pages/robot_page";
import { remoteOf } from "./remotes";

vi.mock("../../web/src/chart/robot_chart", () => ({ RobotChart: () => null }));
vi.mock("../../web/src/robot_view/values_panel", () => ({ ValuesPanel: () => null }));
vi.mock("../../web/src/camera/camera_view", () => ({ CameraView: () => null }));
beforeEach(() => void vi.stubGlobal("navigator", window.navigator));
afterEach(() => {
  clear();
  vi.unstubAllGlobals();
  vi.restoreAllMocks();
});

test("a stop that the robot does not answer is passed on by the gateway, and not sent again", async () => {
  const error = Object.create(RobotRaconteurError.prototype) as RobotRaconteurError;
  const silent = () => Promise.reject(Object.assign(error, { code: ErrorCode.RequestTimeout, message: "no answer" }));
  const remote = { ...remoteOf([]), has: () => false, get: silent, on: () => () => undefined, urgent: vi.fn(silent) };
  const fetched = vi.spyOn(session, "fetch").mockImplementation(async () => Response.json({ lease: "key" }));
  const safe = ["Create.Drive"];
  show(RobotPage, {
    link: { state: new Store({ kind: "online", since: 0, remote }) },
    list: { state: new Store({ kind: "known", devices: [{ name: "robot", safe }] }) },
    device: "robot",
    service: "Create",
    shown: true,
  } as unknown as RobotPageProps);
  await settle();
  find(".pad-stop").click();
  await vi.waitFor(() => expect(text()).toContain("passed on by the gateway"));
  expect(fetched.mock.calls.map(([path]) => /lease=(\w+)/.exec(path)?.[1])).toEqual(["take", "release"]);
  expect(remote.urgent).toHaveBeenCalledOnce();
});
