// Boards that the page makes: by the type of an object, else by its members.
import { definitions, scope } from "./arm";
import { memberOf } from "./members";
import { hasPreset, presetFor, stopFor } from "../../web/src/board/presets";
import { ROBOT_STOP } from "../../web/src/robot/stop";
import { Definitions } from "../../web/src/values/definitions";

describe("a board that the page makes", () => {
  test("begins without panels of devices that the gateway does not have", () => {
    const drive = memberOf("function", "void", "Drive");
    const robot = {
      type: "experimental.simulatedcreate.SimulatedCreate",
      members: [drive, { ...drive, name: "FrameStream", kind: "pipe" as const, type: "WebcamImage" }],
      definitions: new Definitions([]),
      scope: "experimental.simulatedcreate",
    };
    const kinds = (devices?: string[]) => presetFor({ ...robot, devices }).panels.map(({ kind }) => kind);
    expect(kinds()).toContain("image");
    expect(kinds(["create", "webcams"])).toContain("image");
    expect(kinds(["robot-1", "robot-2"])).not.toContain("image");
    const cameras = { ...robot, type: "experimental.createwebcam2.WebcamHost", devices: ["eyes"] };
    expect(presetFor(cameras).panels.map(({ kind }) => kind)).toEqual(["image", "image"]); // of the service itself
  });

  test("starts from the type where it is known, else from the members", () => {
    const members = [
      memberOf("wire", "Pose", "pose"),
      memberOf("function", "void", "halt"),
      memberOf("property", "double", "then"),
    ];
    const made = presetFor({ type: "com.example.arm.Robot", members, definitions, scope });
    expect(made.panels.map(({ kind }) => kind)).toEqual(["plot", "table", "form", "table"]);
    expect(made.stop).toBeNull(); // a file's: the object's own is known only as long as the object has it
    expect(hasPreset("__proto__", definitions) || hasPreset("constructor", definitions)).toBe(false);
    const tool = "com.robotraconteur.robotics.tool.Tool";
    expect(
      presetFor({ type: tool, members: [memberOf("function", "void", "open")], definitions, scope }).panels,
    ).toHaveLength(1);
    expect(hasPreset(tool, definitions)).toBe(true);
  });

  test("a camera's board has its settings: what there is, and the calls that read and change them", () => {
    const type = "com.robotraconteur.imaging.Camera";
    const members = [
      memberOf("property", "com.robotraconteur.param.ParameterInfo{list}", "param_info"),
      memberOf("function", "varvalue", "getf_param"),
      memberOf("function", "void", "setf_param"),
    ];
    const { panels } = presetFor({ type, members, definitions, scope: "com.robotraconteur.imaging" });
    expect(panels.map(({ kind, settings }) => [kind, settings])).toEqual([
      ["streams", {}],
      ["form", { members: ["setf_param", "getf_param"] }],
      ["table", { member: "param_info" }],
    ]);
  });

  test("fits a type that implements a standard one, however it is named there, and calls nothing that stops nothing", () => {
    const driver = new Definitions([
      "service com.example.ur\nusing com.example.base.Arm as A\nobject UR5\nimplements A\nend",
      "service com.example.base\nobject Arm\nimplements Other\nimplements com.robotraconteur.robotics.robot.Robot\nend\nobject Other\nimplements Arm\nend",
    ]);
    const type = "com.example.ur.UR5";
    expect([...driver.implemented(type)].sort()).toEqual([
      "com.example.base.Arm",
      "com.example.base.Other",
      "com.robotraconteur.robotics.robot.Robot",
    ]);
    expect(hasPreset(type, driver)).toBe(true);
    const halt = (stops: string) => memberOf("function", stops, "halt");
    const described = { type, definitions: driver, scope: "com.example.ur" };
    expect(stopFor({ ...described, members: [halt("void")] })).toEqual(ROBOT_STOP);
    expect(stopFor({ ...described, members: [halt("double{generator}")] })).toBeNull();
    expect(presetFor({ ...described, members: [halt("void")] }).panels[0]?.kind).toBe("robot");
  });
});
