// The robot's readings, each with its last half minute.
// Layer: web/robot_view.

import type { ComponentChildren } from "preact";
import { useStore } from "../app/store";
import { Plot } from "../chart/plot";
import type { RobotModel, Told } from "../robot/robot_model";
import { side_of } from "../robot/robot_model";
import { rate_of } from "../robot/series";
import { Failure } from "../ui/failure";
import { useAge } from "../ui/use_age";
import { format_hex } from "../values/format";

export function ValuesPanel({ model, live }: { model: RobotModel; live: boolean }) {
  const readings = useStore(model.readings);
  const trouble = useStore(model.trouble);
  const { series } = model;
  const { distance_mm, angle_deg, bumpers, left_wheel_mm_s, right_wheel_mm_s, packet } = readings;
  const has_wheels = left_wheel_mm_s !== null || right_wheel_mm_s !== null;
  const packets_come = useAge(() => model.heard_at("packet")) === null;
  const packet_rate = packets_come ? rate_of(series.packets, performance.now()).toFixed(0) : "0";
  return (
    <section class="panel values" aria-labelledby="values-title">
      <h2 id="values-title">Values</h2>
      <div class="readings">
        <Reading model={model} told="distance_mm" name="Distance" id="distance" value={distance_mm} unit="mm">
          <Plot series={[series.distance]} label="Distance, last 30 seconds" min_span={100} live={live} />
        </Reading>
        <Reading model={model} told="angle_deg" name="Angle" id="angle" value={angle_deg} unit="°">
          <Plot series={[series.angle]} label="Angle, last 30 seconds" min_span={10} first_colour={1} live={live} />
        </Reading>
        <Reading model={model} told="left_wheel_mm_s" name="Wheels" id="wheels" value={has_wheels ? "" : null} unit="mm/s">
          <Plot series={[series.left_wheel, series.right_wheel]} label="Wheel speeds, last 30 seconds" min_span={50} first_colour={2} live={live} />
          <p class="legend-line">
            <span class="legend-3">
              left <b data-reading="left-wheel">{left_wheel_mm_s ?? "–"}</b>
            </span>
            <span class="legend-4">
              right <b data-reading="right-wheel">{right_wheel_mm_s ?? "–"}</b>
            </span>
          </p>
        </Reading>
        <Reading model={model} told="bumpers" name="Bumpers" id="bumpers" value={bumpers === null ? null : side_of(bumpers) || "free"}>
          <BumperPicture bits={bumpers ?? 0} />
        </Reading>
        <Reading model={model} told="packet" name="Packets" id="packets" value={packet && packet_rate} unit="a second">
          <p class="code packet-bytes">{packet ? `${packet.id}: ${format_hex(packet.bytes, 14)}` : "none yet"}</p>
        </Reading>
      </div>
      <Failure text={live ? trouble : null} />
    </section>
  );
}

interface ReadingProps {
  model: RobotModel;
  /** What of the robot's news this shows. */
  told: Told;
  name: string;
  id: string;
  value: number | string | null;
  unit?: string;
  children: ComponentChildren;
}

function Reading({ model, told, name, id, value, unit, children }: ReadingProps) {
  const age = useAge(() => model.heard_at(told));
  return (
    <div class={`reading ${age === null ? "" : "is-stale"}`} data-told={id}>
      <div class="reading-head">
        <h3>{name}</h3>
        {age !== null && <p class="reading-age">{age}</p>}
        <p class="reading-value" data-reading={id}>
          {value ?? "–"} {unit && <span class="unit">{unit}</span>}
        </p>
      </div>
      {children}
    </div>
  );
}

/** `bits`: of property Bumpers. */
function BumperPicture({ bits }: { bits: number }) {
  return (
    <svg class="bumpers" viewBox="0 0 80 44" aria-hidden="true">
      <path class={`bumper ${bits & 2 ? "is-pressed" : ""}`} d="M8 40a32 32 0 0 1 30-32" />
      <path class={`bumper ${bits & 1 ? "is-pressed" : ""}`} d="M42 8a32 32 0 0 1 30 32" />
    </svg>
  );
}
