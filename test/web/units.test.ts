// Units of numbers, by the documentation of their fields and by their names.
import { Definitions } from "../../web/src/values/definitions";
import { unitOf } from "../../web/src/values/units";

const fields = (...lines: string[]) =>
  new Definitions([`service com.example.units\nstdver 0.10\nstruct S\n    ${lines.join("\n    ")}\nend\n`]);
const unit = (name: string, documentation = "") =>
  unitOf(
    "S",
    name,
    fields(...(documentation ? [`## ${documentation}`] : []), `field double ${name}`),
    "com.example.units",
  );

it.each([
  ["velocity_rad_s", "rad/s"],
  ["speed_m_s", "m/s"],
  ["angle_rad", "rad"],
  ["offset_mm", "mm"],
  ["delay_ms", "ms"],
  ["torque_nm", "Nm"],
  ["motor_current_a", "A"],
  ["wavelength_nm", ""],
  ["phase_a", ""],
  ["status", ""],
])("%s by its name: %s", (name, expected) => expect(unit(name)).toBe(expected));

it.each([
  ["Position of the probe [mm]", "mm"],
  ["Speed (max) along the rail [m/s]", "m/s"],
  ["Temperature of the motor (°C)", "°C"],
  ["Distance in cm, from the wall", "cm"],
  ["Share of all, [0,1]", ""],
  ["Speed (max)", ""],
  ["Set in the configuration", ""],
])("by its documentation, %s", (documentation, expected) => expect(unit("x", documentation)).toBe(expected));

test("of a value without fields, by its member", () => {
  const of = (name: string, documentation: string, path = "") =>
    unitOf("double", path, fields(), "com.example.units", { name, documentation });
  expect(of("distance", "Distance travelled, in mm; backwards counts down.")).toBe("mm");
  expect(of("joint_rad", "", "[2]")).toBe("rad");
  expect(of("count", "")).toBe("");
});
