// When and where the robot bumped, newest first.
// Layer: web/robot_view.

import { t } from "../app/language";
import { useStore } from "../app/store";
import type { RobotModel } from "../robot/robot_model";
import { clockTimeMs } from "../ui/words";

export function BumpLog({ model }: { model: RobotModel }) {
  const bumps = useStore(model.bumps);
  return (
    <section class="panel bumps" aria-labelledby="bumps-title">
      <h2 id="bumps-title">{t("Bumps")}</h2>
      {bumps.length === 0 ? (
        <p class="note">{t("None yet. Each one gets its time, its side, and a rock on the chart.")}</p>
      ) : (
        <ol class="log" tabIndex={0} aria-labelledby="bumps-title">
          {bumps.map((bump) => (
            <li key={bump.number}>
              <span class="log-number">{bump.number}</span>
              <time class="log-time" dateTime={new Date(bump.time).toISOString()}>
                {clockTimeMs(bump.time)}
              </time>
              <span>{bump.side}</span>
              <span class="log-place">
                {bump.pose.x.toFixed(2)}, {bump.pose.y.toFixed(2)} m
              </span>
            </li>
          ))}
        </ol>
      )}
    </section>
  );
}
