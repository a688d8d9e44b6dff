// The robot's readings, each with its last half minute.
// Layer: web/robot_view.

import type { ComponentChildren } from "preact";
import { useStore } from "../app/store";
import { Plot } from "../chart/plot";
import type { RobotModel } from "../robot/robot_model";
import { side_of } from "../robot/robot_model";
import { rate_of } from "../robot/series";
import { Failure } from "../ui/failure";
import { format_hex } from "../values/format";

export function ValuesPanel({ model, live }: { model: RobotModel; live: boolean }) {
  const readings = useStore(model.readings);
  const trouble = useStore(model.trouble);
  const { series } = model;
  const { distance_mm, angle_deg, left_wheel_mm_s, right_wheel_mm_s, packet } = readings;
  const has_wheels = left_wheel_mm_s !== null || right_wheel_mm_s !== null;
  return (
    <section class={`panel values ${live ? "" : "is-stale"}`} aria-labelledby="values-title">
      <h2 id="values-title">Values</h2>
      <div class="readings">
        <Reading name="Distance" id="distance" value={distance_mm} unit="mm">
          <Plot series={[series.distance]} label="Distance, last 30 seconds" min_span={100} live={live} />
        </Reading>
        <Reading name="Angle" id="angle" value={angle_deg} unit="°">
          <Plot series={[series.angle]} label="Angle, last 30 seconds" min_span={10} first_colour={1} live={live} />
        </Reading>
        <Reading name="Wheels" id="wheels" value={has_wheels ? "" : null} unit="mm/s">
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
        <Bumpers bits={readings.bumpers} />
        <div class="reading">
          <div class="reading-head">
            <h3>Packets</h3>
            <p class="reading-value" data-reading="packets">
              {packet ? (live ? rate_of(series.packets, performance.now()).toFixed(0) : "0") : "–"}{" "}
              <span class="unit">a second</span>
            </p>
          </div>
          <p class="code packet-bytes">{packet ? `${packet.id}: ${format_hex(packet.bytes, 14)}` : "none yet"}</p>
        </div>
      </div>
      <Failure text={live ? trouble : null} />
    </section>
  );
}

interface ReadingProps {
  name: string;
  id: string;
  value: number | string | null;
  unit: string;
  children: ComponentChildren;
}

function Reading({ name, id, value, unit, children }: ReadingProps) {
  return (
    <div class="reading">
      <div class="reading-head">
        <h3>{name}</h3>
        <p class="reading-value" data-reading={id}>
          {value ?? "–"} <span class="unit">{unit}</span>
        </p>
      </div>
      {children}
    </div>
  );
}

function Bumpers({ bits }: { bits: number | null }) {
  const text = bits === null ? "–" : side_of(bits) || "free";
  return (
    <div class="reading">
      <div class="reading-head">
        <h3>Bumpers</h3>
        <p class="reading-value" data-reading="bumpers">
          {text}
        </p>
      </div>
      <svg class="bumpers" viewBox="0 0 80 44" aria-hidden="true">
        <path class={`bumper ${(bits ?? 0) & 2 ? "is-pressed" : ""}`} d="M8 40a32 32 0 0 1 30-32" />
        <path class={`bumper ${(bits ?? 0) & 1 ? "is-pressed" : ""}`} d="M42 8a32 32 0 0 1 30 32" />
      </svg>
    </div>
  );
}
