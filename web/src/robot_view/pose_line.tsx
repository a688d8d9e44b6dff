// The pose in numbers, under the chart.
// Layer: web/robot_view.

import { useEffect, useState } from "preact/hooks";
import { useStore } from "../app/store";
import type { Pose } from "../robot/reckoning";
import type { RobotModel } from "../robot/robot_model";

const SHOW_MS = 100;

export function PoseLine({ model, live }: { model: RobotModel; live: boolean }) {
  const source = useStore(model.poseSource);
  const [pose, setPose] = useState<Pose>(model.pose);
  useEffect(() => {
    let timer: ReturnType<typeof setTimeout> | undefined;
    const unwatch = model.onMoved(() => {
      timer ??= setTimeout(() => ((timer = undefined), setPose(model.pose)), SHOW_MS);
    });
    return () => {
      unwatch();
      clearTimeout(timer);
    };
  }, [model]);
  const degrees = (pose.theta * 180) / Math.PI;
  return (
    <>
      <dl class="pose">
        <Coordinate name="x" sign="x" text={`${fixed(pose.x, 3)} m`} />
        <Coordinate name="y" sign="y" text={`${fixed(pose.y, 3)} m`} />
        <Coordinate name="heading" sign="θ" text={`${fixed(degrees, 1)}°`} />
      </dl>
      <p
        class="note"
        title={source === "device" ? undefined : "From DistanceTraveled and AngleTraveled, since this page was opened"}
      >
        {!live ? "last known" : source === "device" ? "" : "reckoned"}
      </p>
    </>
  );
}

function Coordinate({ name, sign, text }: { name: string; sign: string; text: string }) {
  return (
    <div>
      <dt>{sign === name ? name : <abbr title={name}>{sign}</abbr>}</dt>
      <dd data-pose={name}>{text}</dd>
    </div>
  );
}

/** Fixed decimals without a "-0.000". */
function fixed(value: number, digits: number): string {
  const text = value.toFixed(digits);
  return Number(text) === 0 ? (0).toFixed(digits) : text;
}
