// A trajectory of a standard robot: waypoints in a table, taken from where the robot is or typed in; run, followed and stopped.
// Layer: web/panels. Source: com.robotraconteur.robotics.robot, execute_trajectory.

import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import { t } from "../app/language";
import { useStore } from "../app/store";
import { isFresh, useFeed } from "../live/use_feed";
import { useAction } from "../members/row";
import { onStop } from "../robot/control";
import { ControlLine, useControl } from "../ui/control_line";
import { Failure } from "../ui/failure";
import { enumName } from "../values/definitions";
import { CommandMode } from "./command_mode";
import { GeneratorRun } from "./generator_run";
import { jointsOf, readState } from "./joints";
import { NumberField } from "./number_field";
import type { PanelProps } from "./panel";
import { Freshness } from "./parts";
import { useRobotInfo } from "./robot_info";
import { MOST_WAYPOINTS, trajectoryThrough, waypointsIn } from "./waypoints";
import type { Waypoint } from "./waypoints";
import "./trajectory_panel.css";

const WIRE = "robot_state";
const PROGRESS = "advanced_robot_state";
const NEXT_SECONDS = 2;

export default function TrajectoryPanel(props: PanelProps) {
  const { object, members, definitions, scope, place, settings, change } = props;
  const has = (name: string): boolean => members.some((each) => each.name === name);
  const canRun = has(WIRE) && has("execute_trajectory");
  const look = useFeed(object, canRun ? "wire" : null, WIRE);
  const advanced = useFeed(object, canRun && has(PROGRESS) ? "wire" : null, PROGRESS);
  const { info, failure: unknown } = useRobotInfo(object, canRun);
  const joints = useMemo(() => jointsOf(info), [info]);
  const [said, setSaid] = useState<string | null>(null);
  const beginning = useAction();
  const { control, last, isOpen } = useControl(object);
  const run = useMemo(() => new GeneratorRun((status) => setSaid(troubleIn(status, props))), []);
  const running = useStore(run.state);
  const failure = useStore(run.failure);
  const mode = useMemo(() => new CommandMode(), []);
  useEffect(
    () => () => {
      mode.leave();
      run.leave();
    },
    [object, mode, run],
  );
  useEffect(() => onStop(() => void run.stop()), [run]);
  const positions = readState(look.value)?.positions ?? new Float64Array();
  const here = useRef(positions);
  here.current = positions;
  if (!canRun) return <p class="note">{t("This object runs no trajectories of the standard types.")}</p>;

  const waypoints = waypointsIn(settings, joints.length);
  const set = (next: readonly Waypoint[]): void => change({ ...settings, waypoints: next });
  const edit = (at: number, next: Partial<Waypoint>): void =>
    set(waypoints.map((each, i) => (i === at ? { ...each, ...next } : each)));
  const isKnown = joints.length > 0; // else nobody can see what is changed
  const where = (): number[] => joints.map((_, i) => Number((here.current[i] ?? 0).toFixed(4)));
  const begin = (): void =>
    beginning.run(async () => {
      setSaid(null);
      if (!object) throw new Error(t("not connected"));
      trajectoryThrough(here.current, waypoints, joints); // what is wrong with it is said before anything is commanded
      const wanted = definitions.enum("RobotCommandMode", scope)?.values.get("trajectory") ?? 2;
      if (!(await mode.change(object, control, wanted))) return;
      const trajectory = trajectoryThrough(here.current, waypoints, joints);
      void run.go(
        true,
        () => object.generate("execute_trajectory", [trajectory]),
        () => undefined,
      );
    });
  const isUnderWay = running === "running" || running === "stopping" || beginning.busy;
  const isHere = isFresh(look, object) && isKnown && positions.length > 0; // else nobody knows where the robot is
  const canBegin = isHere && isOpen && !isUnderWay;
  return (
    <div class="trajectory-panel">
      <ControlLine control={last} isThere={object !== null} place={place} />
      <div class="row-line">
        <button class="button button-main" type="button" disabled={!canBegin || waypoints.length === 0} onClick={begin}>
          {t("Run")}
        </button>
        <button class="button" type="button" disabled={running !== "running"} onClick={() => void run.stop()}>
          {t("Stop trajectory")}
        </button>
        <Progress state={advanced.value} isRunning={running === "running"} waypoints={waypoints} />
        <span class="note" role="status" data-run={running}>
          {running === "stopping" ? t("stopping: the device answers the step under way first") : t(running)}
        </span>
      </div>
      <Failure text={beginning.failure ?? failure ?? said ?? unknown} />
      <div class="panel-scroll">
        <table class="waypoints" aria-label={t("Waypoints")}>
          <thead>
            <tr>
              <th scope="col">{t("After")} s</th>
              {joints.map(({ name, unit }) => (
                <th key={name} scope="col">
                  {name} {unit}
                </th>
              ))}
              <td />
            </tr>
          </thead>
          <tbody>
            {waypoints.map(({ seconds, positions: there }, at) => (
              <tr key={at}>
                <td>
                  <NumberField
                    label={t("Waypoint {0}: seconds", at + 1)}
                    value={seconds}
                    least={0}
                    disabled={!isKnown}
                    change={(next) => edit(at, { seconds: next })}
                  />
                </td>
                {joints.map(({ name }, i) => (
                  <td key={name}>
                    <NumberField
                      label={t("Waypoint {0}: {1}", at + 1, name)}
                      value={there[i] ?? 0}
                      change={(next) => edit(at, { positions: there.map((old, j) => (j === i ? next : old)) })}
                    />
                  </td>
                ))}
                <td class="waypoint-tools">
                  <button
                    class="button button-quiet"
                    type="button"
                    disabled={!isHere}
                    onClick={() => edit(at, { positions: [...where(), ...there.slice(joints.length)] })}
                  >
                    {t("Here")}
                    <span class="unseen"> {at + 1}</span>
                  </button>
                  <button
                    class="button button-quiet"
                    type="button"
                    disabled={!isKnown}
                    onClick={() => set(waypoints.filter((_, i) => i !== at))}
                  >
                    {t("Remove")}
                    <span class="unseen"> {at + 1}</span>
                  </button>
                </td>
              </tr>
            ))}
          </tbody>
        </table>
        {waypoints.length === 0 && (
          <p class="note">{t("Jog the robot to a place and add it, or add it and type in another place.")}</p>
        )}
        <button
          class="button"
          type="button"
          disabled={!isHere || waypoints.length >= MOST_WAYPOINTS}
          onClick={() =>
            set([...waypoints, { seconds: (waypoints.at(-1)?.seconds ?? 0) + NEXT_SECONDS, positions: where() }])
          }
        >
          {t("Add where the robot is")}
        </button>
      </div>
      <Freshness look={look} isLive={object !== null} />
    </div>
  );
}

/** How far the robot has come: by what it says, at whatever speed ratio it has. */
function Progress({
  state,
  isRunning,
  waypoints,
}: {
  state: unknown;
  isRunning: boolean;
  waypoints: readonly Waypoint[];
}) {
  const { trajectory_time: at, trajectory_max_time: end } = (state ?? {}) as Readonly<Record<string, unknown>>;
  if (!isRunning || typeof at !== "number" || typeof end !== "number" || end <= 0) return null;
  const share = Math.min(1, at / end);
  const total = waypoints.at(-1)?.seconds ?? 0;
  const passed = waypoints.filter(({ seconds }) => seconds <= share * total).length;
  return (
    <>
      <progress max={1} value={share} aria-label={t("Progress")} />
      <span class="note">
        {t("{0} of {1} s, {2} of {3} waypoints", at.toFixed(1), end.toFixed(1), passed, waypoints.length)}
      </span>
    </>
  );
}

/** null: it goes well. */
function troubleIn(status: unknown, { definitions, scope }: PanelProps): string | null {
  const { action_status: code } = (status ?? {}) as Readonly<Record<string, unknown>>;
  if (typeof code !== "number" || code >= 0) return null;
  const names = definitions.enum("com.robotraconteur.action.ActionStatusCode", scope);
  return t("The robot says: {0}", (names && enumName(code, names)) ?? code);
}
