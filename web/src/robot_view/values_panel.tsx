// The robot's readings, each with its last half minute.
// Layer: web/robot_view.

import type { ComponentChildren } from "preact";
import { t } from "../app/language";
import { useStore } from "../app/store";
import { Plot } from "../chart/plot";
import type { RobotModel, Told } from "../robot/robot_model";
import { sideOf } from "../robot/robot_model";
import { Failure } from "../ui/failure";
import { useAge } from "../ui/use_age";
import { formatHex } from "../values/format";

export function ValuesPanel({ model, live }: { model: RobotModel; live: boolean }) {
  const readings = useStore(model.readings);
  const trouble = useStore(model.trouble);
  const { series } = model;
  const { distanceMm, angleDeg, bumpers, leftWheelMmS, rightWheelMmS, packet } = readings;
  const hasWheels = leftWheelMmS !== null || rightWheelMmS !== null;
  const packetsCome = useAge(() => model.heardAt("packet")) === null;
  const packetRate = packetsCome ? model.packetPace.rate(performance.now()).toFixed(0) : "0";
  return (
    <section class="panel values" aria-labelledby="values-title">
      <h2 id="values-title">{t("Values")}</h2>
      <div class="readings">
        <Reading model={model} told="distanceMm" name={t("Distance")} id="distance" value={distanceMm} unit="mm">
          <Plot series={[series.distance]} label={t("Distance, last 30 seconds")} minSpan={100} live={live} />
        </Reading>
        <Reading model={model} told="angleDeg" name={t("Angle")} id="angle" value={angleDeg} unit="°">
          <Plot series={[series.angle]} label={t("Angle, last 30 seconds")} minSpan={10} firstColour={1} live={live} />
        </Reading>
        <Reading
          model={model}
          told="leftWheelMmS"
          name={t("Wheels")}
          id="wheels"
          value={hasWheels ? "" : null}
          unit="mm/s"
        >
          <Plot
            series={[series.leftWheel, series.rightWheel]}
            label={t("Wheel speeds, last 30 seconds")}
            minSpan={50}
            firstColour={2}
            live={live}
          />
          <p class="legend-line">
            <span class="legend-3">
              {t("left")} <b data-reading="left-wheel">{leftWheelMmS ?? "–"}</b>
            </span>
            <span class="legend-4">
              {t("right")} <b data-reading="right-wheel">{rightWheelMmS ?? "–"}</b>
            </span>
          </p>
        </Reading>
        <Reading
          model={model}
          told="bumpers"
          name={t("Bumpers")}
          id="bumpers"
          value={bumpers === null ? null : sideOf(bumpers) || t("free")}
        >
          <BumperPicture bits={bumpers ?? 0} />
        </Reading>
        <Reading
          model={model}
          told="packet"
          name={t("Packets")}
          id="packets"
          value={packet && packetRate}
          unit={t("a second")}
        >
          <p class="code packet-bytes">{packet ? `${packet.id}: ${formatHex(packet.bytes, 14)}` : t("none yet")}</p>
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
  const age = useAge(() => model.heardAt(told));
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
