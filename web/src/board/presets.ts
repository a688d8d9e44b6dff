// The board that an object starts with: of the standard types by hand, of all others by what its members are.
// Layer: web/board, pure.

import { isGenerator } from "../robot/remote";
import type { Member } from "../robot/remote";
import { ROBOT_STOP } from "../robot/stop";
import type { StopCall } from "../robot/stop";
import type { Definitions } from "../values/definitions";
import { isNumeric, parseType } from "../values/type_text";
import { makeId } from "./board";
import type { Board, Panel, PanelKind, Settings } from "./board";
import { COLUMNS, settle } from "./layout";

export interface Described {
  type: string;
  members: readonly Member[];
  definitions: Definitions;
  scope: string;
  /** Those of the gateway, by name: a board begins without panels of others. Left out: not known. */
  devices?: readonly string[] | undefined;
}

/** `place`: whose members, as those of a Panel: "device/service object". */
type Spec = [
  kind: PanelKind,
  x: number,
  y: number,
  w: number,
  h: number,
  settings?: Settings,
  title?: string,
  place?: string,
];

interface Preset {
  stop: StopCall | null;
  panels: readonly Spec[];
}

const SCANNER: Preset = {
  stop: null,
  panels: [
    ["scene", 0, 0, 8, 13, { member: "laser_scan_sensor_data" }],
    ["table", 8, 0, 4, 7, { member: "scanner_info" }],
    ["streams", 8, 7, 4, 6],
  ],
};
const POINTS: Preset = {
  stop: null,
  panels: [
    ["scene", 0, 0, 8, 13, { member: "point_cloud_sensor_data" }],
    ["table", 8, 0, 4, 7, { member: "point_sensor_info" }],
    ["streams", 8, 7, 4, 6],
  ],
};
const ROBOT = "com.robotraconteur.robotics.robot.Robot";
export const STANDARD: Readonly<Record<string, Preset>> = {
  [ROBOT]: {
    stop: ROBOT_STOP,
    panels: [
      ["robot", 0, 0, 7, 13],
      ["plot", 7, 0, 5, 9, { member: "robot_state" }],
      ["form", 7, 9, 5, 4, { members: ["enable", "disable", "reset_errors"] }, "Power"],
      ["trajectory", 0, 13, 7, 10],
      ["scene", 7, 13, 5, 10, { member: "robot_state" }],
      ["table", 0, 23, 5, 10, { member: "robot_state" }],
      ["form", 5, 23, 4, 5, { member: "speed_ratio" }],
      ["log", 9, 23, 3, 5],
    ],
  },
  ["com.robotraconteur.imaging.Camera"]: {
    stop: null,
    panels: [
      ["image", 0, 0, 8, 12, { member: "frame_stream_compressed" }],
      ["form", 8, 0, 4, 6, { members: ["start_streaming", "stop_streaming", "trigger"] }, "Streaming"],
      ["table", 8, 6, 4, 6, { member: "camera_state" }],
      ["form", 0, 12, 4, 7, { member: "trigger_mode" }],
      ["table", 4, 12, 4, 7, { member: "camera_info" }],
      ["streams", 8, 12, 4, 7],
      ["form", 0, 19, 4, 8, { members: ["setf_param", "getf_param"] }, "Settings"],
      ["table", 4, 19, 8, 8, { member: "param_info" }],
    ],
  },
  ["com.robotraconteur.robotics.tool.Tool"]: {
    stop: { call: "halt", args: [] },
    panels: [
      ["form", 0, 0, 4, 10, { members: ["open", "close", "setf_command", "halt"] }, "Tool"],
      ["plot", 4, 0, 8, 10, { member: "tool_state", paths: ["position", "command"] }],
      ["table", 0, 10, 6, 7, { member: "tool_state" }],
      ["form", 6, 10, 6, 7, { members: ["enable", "disable", "reset_errors", "home"] }, "Power"],
    ],
  },
  ["com.robotraconteur.servo.Servo"]: {
    stop: { call: "halt", args: [] },
    panels: [
      ["plot", 0, 0, 8, 10, { member: "position" }],
      ["table", 8, 0, 4, 10, { member: "servo_state" }],
      ["form", 0, 10, 4, 8, { member: "mode" }],
      ["form", 4, 10, 4, 8, { member: "position_command" }],
      ["form", 8, 10, 4, 8, { member: "trapezoidal_move" }],
    ],
  },
  ["com.robotraconteur.actuator.Actuator"]: {
    stop: null,
    panels: [
      ["plot", 0, 0, 8, 10, { member: "actuator_state" }],
      ["table", 8, 0, 4, 10, { member: "actuator_state" }],
      ["form", 0, 10, 4, 8, { member: "actuator_mode" }],
      ["form", 4, 10, 4, 8, { member: "actuator_command" }],
      ["table", 8, 10, 4, 8, { member: "actuator_info" }],
    ],
  },
  ["com.robotraconteur.laserscanner.LaserScanner"]: SCANNER,
  ["com.robotraconteur.laserscanner.LaserScanPartScanner"]: SCANNER,
  ["com.robotraconteur.pointcloud.sensor.PointCloudSensor"]: POINTS,
  ["com.robotraconteur.pointcloud.sensor.PointCloudPartSensor"]: POINTS,
  ["com.robotraconteur.hid.joystick.Joystick"]: {
    stop: null,
    panels: [
      ["plot", 0, 0, 8, 10, { member: "gamepad_state", paths: ["left_x", "left_y", "right_x", "right_y"] }],
      ["table", 8, 0, 4, 10, { member: "gamepad_state" }],
      ["table", 0, 10, 4, 8, { member: "joystick_state" }],
      ["form", 4, 10, 4, 8, { members: ["rumble", "force_feedback"] }],
      ["table", 8, 10, 4, 8, { member: "joystick_info" }],
    ],
  },
  // One input or output of a device of the type SignalDevice.
  ["com.robotraconteur.signal.Signal"]: {
    stop: null,
    panels: [
      ["plot", 0, 0, 8, 8, { member: "signal_value_vec" }],
      ["table", 8, 0, 4, 8, { member: "signal_value" }],
      ["form", 0, 8, 6, 7, { members: ["signal_command", "signal_command_vec"] }],
      ["table", 6, 8, 6, 7, { member: "signal_info" }],
    ],
  },
  // Of `rrgate demo`: the robot, whose cameras are another device, and those cameras.
  ["experimental.simulatedcreate.SimulatedCreate"]: {
    stop: null,
    panels: [
      ["plot", 0, 0, 5, 8, { member: "state", paths: ["x", "y", "heading"] }, "Pose"],
      ["image", 5, 0, 4, 8, { member: "FrameStream" }, "Left camera", "webcams/Webcam Webcams[0]"],
      ["form", 9, 0, 3, 8, { member: "Drive" }, "Calls"],
      ["table", 0, 8, 5, 7, { member: "state" }],
      ["log", 5, 8, 4, 7],
      ["table", 9, 8, 3, 7, { member: "packets" }],
    ],
  },
  ["experimental.createwebcam2.WebcamHost"]: {
    stop: null,
    panels: [
      ["image", 0, 0, 6, 11, { member: "FrameStream" }, "Left", " Webcams[0]"],
      ["image", 6, 0, 6, 11, { member: "FrameStream" }, "Right", " Webcams[1]"],
    ],
  },
  // Of `rrgate demo fleet`.
  ["experimental.fleet.Sensor"]: {
    stop: null,
    panels: [
      ["plot", 0, 0, 8, 9, { member: "temperature" }],
      ["form", 8, 0, 4, 5, { members: ["offset"] }],
      ["table", 8, 5, 4, 4, { member: "temperature" }],
    ],
  },
  // Of `rrgate demo microassembly`, whose cameras are another device.
  ["experimental.microassembly.Cell"]: {
    stop: { call: "halt", args: [] },
    panels: [
      ["image", 0, 0, 4, 8, { member: "picture" }, "Microscope 0", "cameras/Cameras microscopes[0]"],
      ["image", 4, 0, 4, 8, { member: "picture" }, "Microscope 1", "cameras/Cameras microscopes[1]"],
      ["image", 0, 8, 4, 8, { member: "picture" }, "Microscope 2", "cameras/Cameras microscopes[2]"],
      ["image", 4, 8, 4, 8, { member: "picture" }, "Microscope 3", "cameras/Cameras microscopes[3]"],
      ["form", 8, 0, 4, 9, { members: ["move"] }, "Probes"],
      ["form", 8, 9, 4, 7, { members: ["focus", "illuminate"] }, "Focus and light"],
      ["table", 0, 16, 8, 8, { member: "poses" }],
      ["table", 8, 16, 4, 4, { member: "parts" }],
    ],
  },
  // Of `rrgate demo conference-room`, whose lights and sensors are other devices.
  ["experimental.conference_room.Controller"]: {
    stop: null,
    panels: [
      ["form", 0, 0, 4, 9, { members: ["target", "gain", "on"] }, "Target"],
      ["plot", 4, 0, 8, 9, { member: "mean" }, "Mean of the sensors"],
      ["plot", 4, 9, 8, 7, { member: "error" }, "Error"],
      ["table", 0, 9, 4, 7, { member: "shown" }, "Lights", "lights/Lights"],
      ["table", 0, 16, 6, 8, { member: "readings" }, "Northern sensors", "sensors-north/Sensors"],
      ["table", 6, 16, 6, 8, { member: "readings" }, "Southern sensors", "sensors-south/Sensors"],
    ],
  },
  // Of `rrgate demo baxter`: its arms, cameras and grippers are other services of the device.
  ["experimental.baxter.Base"]: {
    stop: { call: "halt", args: [] },
    panels: [
      [
        "teleop",
        0,
        0,
        4,
        11,
        {
          member: "drive",
          axes: [
            { stick: "right-y", path: "speed", scale: 0.8 },
            { stick: "right-x", path: "turn", scale: -1 },
          ],
          neutral: { speed: "0", turn: "0" },
        },
      ],
      ["image", 4, 0, 5, 11, { member: "frame_stream_compressed" }, "Head", "baxter/head_camera"],
      ["table", 9, 0, 3, 6, { member: "state" }],
      ["form", 9, 6, 3, 5, { members: ["open", "close"] }, "Left gripper", "baxter/left_gripper"],
      ["robot", 0, 11, 6, 13, {}, "Left arm", "baxter/left_arm"],
      ["robot", 6, 11, 6, 13, {}, "Right arm", "baxter/right_arm"],
      ["image", 0, 24, 4, 9, { member: "frame_stream_compressed" }, "Left hand", "baxter/left_camera"],
      ["form", 4, 24, 4, 5, { members: ["open", "close"] }, "Right gripper", "baxter/right_gripper"],
      ["image", 8, 24, 4, 9, { member: "frame_stream_compressed" }, "Right hand", "baxter/right_camera"],
    ],
  },
  ["com.robotraconteur.sensor.Sensor"]: {
    stop: null,
    panels: [
      ["plot", 0, 0, 8, 10, { member: "sensor_value" }],
      ["table", 8, 0, 4, 10, { member: "sensor_value" }],
      ["table", 0, 10, 6, 7, { member: "sensor_info" }],
      ["streams", 6, 10, 6, 7],
    ],
  },
};

/** Whether the type is known, or one that it implements, so that its board is worth showing first. */
export function hasPreset(type: string, definitions: Definitions): boolean {
  return standardOf(type, definitions) !== undefined;
}

function standardOf(type: string, definitions: Definitions) {
  const types = new Set([type, ...definitions.implemented(type)]);
  const found = Object.keys(STANDARD).find((each) => types.has(each));
  return found === undefined ? undefined : STANDARD[found];
}

/** It says nothing of a stop: that of the object is known as long as the object has it, see stopFor(). */
export function presetFor(object: Described): Board {
  return { panels: settle(panelsFor(object)), columns: COLUMNS, stop: null };
}

function panelsFor(object: Described): Panel[] {
  const standard = standardOf(object.type, object.definitions);
  if (!standard) return byMembers(object);
  return standard.panels
    .filter(([, , , , , settings, , place]) =>
      place === undefined ? isThere(settings, object.members) : isOfDevices(place, object.devices),
    )
    .map((spec) => makePanel(spec));
}

const STOPS = /^(halt|stop|e_?stop|emergency_stop|abort)$/i;

/** That of the standard type, a function that says that it stops, or the demo robot's. */
export function stopFor({ type, members, definitions }: Described): StopCall | null {
  // A call of a generator only begins one: it stops nothing.
  const calls = members.filter(
    (each) => each.kind === "function" && each.parameters.length === 0 && !isGenerator(each),
  );
  const standard = standardOf(type, definitions)?.stop;
  if (standard && calls.some(({ name }) => name === standard.call)) return standard;
  const found = calls.find(({ name }) => STOPS.test(name));
  if (found) return { call: found.name, args: [] };
  return /^experimental\.\w*create\w*\./.test(type) && members.some(({ name }) => name === "Drive")
    ? { call: "Drive", args: [0, 0] }
    : null;
}

const MOST_PLOTS = 4;
const MOST_TABLES = 4;

function byMembers(object: Described): Panel[] {
  const panels: Panel[] = [];
  const columns = [0, 0, 0]; // the heights so far
  const add = (kind: PanelKind, h: number, settings: Settings = {}, title = ""): void => {
    const column = columns.indexOf(Math.min(...columns));
    panels.push(makePanel([kind, column * 4, columns[column] ?? 0, 4, h, settings, title]));
    columns[column] = (columns[column] ?? 0) + h;
  };
  const wires = object.members.filter((each) => each.kind === "wire" && !each.modifiers.includes("writeonly"));
  for (const { name } of object.members.filter((each) => isPicture(each, object)).slice(0, 2))
    add("image", 9, { member: name });
  for (const { name } of wires.filter((each) => hasNumbers(each, object)).slice(0, MOST_PLOTS))
    add("plot", 8, { member: name });
  const structs = wires.filter((each) => structOf(each, object) !== undefined && !isPicture(each, object));
  for (const { name } of structs.slice(0, MOST_TABLES)) add("table", 8, { member: name });
  if (object.members.some(({ kind, type }) => kind === "function" && !type.endsWith("{generator}")))
    add("form", 8, {}, "Calls");
  const property = object.members.find((each) => each.kind === "property" && !each.modifiers.includes("writeonly"));
  if (property) add("table", 6, { member: property.name });
  if (object.members.some(({ kind }) => kind === "event")) add("log", 6);
  if (object.members.some(({ kind }) => kind === "memory")) add("memory", 9);
  if (object.members.some(({ type }) => type.endsWith("{generator}"))) add("generator", 8);
  if (panels.length === 0) add("notes", 5);
  return panels;
}

function structOf(member: Member, { definitions, scope }: Described) {
  return definitions.struct(parseType(member.type).base, scope);
}

/** By the names of the fields: bytes, with a width and a height here or in an inner struct. */
function isPicture(member: Member, object: Described): boolean {
  if (!["wire", "pipe"].includes(member.kind) || member.modifiers.includes("writeonly")) return false;
  const struct = structOf(member, object);
  if (!struct?.fields.some(({ name, type }) => name === "data" && type.startsWith("uint8["))) return false;
  const names = struct.fields.flatMap(({ name, type }) => [
    name,
    ...(object.definitions.struct(parseType(type).base, struct.scope)?.fields.map((inner) => inner.name) ?? []),
  ]);
  return names.includes("width") && names.includes("height");
}

function hasNumbers(member: Member, object: Described): boolean {
  const { base, container } = parseType(member.type);
  if (container !== "none") return false;
  if (isNumeric(base)) return true;
  return (
    !isPicture(member, object) &&
    structOf(member, object)?.fields.some(({ type }) => isNumeric(parseType(type).base)) === true
  );
}

function isThere(settings: Settings | undefined, members: readonly Member[]): boolean {
  const named = settings?.["member"] ?? (settings?.["members"] as readonly string[] | undefined)?.[0];
  return named === undefined || members.some(({ name }) => name === named);
}

function isOfDevices(place: string, devices: readonly string[] | undefined): boolean {
  const device = place.split("/", 1)[0] ?? "";
  return devices === undefined || place.startsWith(" ") || devices.includes(device);
}

function makePanel([kind, x, y, w, h, settings = {}, title = "", place = ""]: Spec): Panel {
  const [from = "", object = ""] = place.split(" ", 2);
  return { id: makeId(), kind, title, from, object, x, y, w, h, settings };
}
