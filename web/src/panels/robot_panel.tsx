// A standard robot: what its flags say, where its joints and tools are, and jogging them while a button is held.
// Layer: web/panels. Source: com.robotraconteur.robotics.robot.

import { useEffect, useMemo, useState } from "preact/hooks";
import { t } from "../app/language";
import { isFresh, useFeed } from "../live/use_feed";
import { useAction } from "../members/row";
import { stopNow, tellStop } from "../robot/control";
import { explain } from "../robot/remote";
import { passOn, ROBOT_STOP, stopDevice } from "../robot/stop";
import { ControlLine, useControl } from "../ui/control_line";
import { Failure } from "../ui/failure";
import { formatNumber } from "../values/format";
import { CommandMode } from "./command_mode";
import { jointsOf, modeName, readState, stateWords } from "./joints";
import type { Joint } from "./joints";
import { JogRow } from "./jog_row";
import { numberIn } from "./panel";
import type { PanelProps } from "./panel";
import { Freshness } from "./parts";
import { useRobotInfo } from "./robot_info";
import { coordinateOf, isTurn, TOOL_AXES, toolsOf, velocityAlong } from "./tools";
import type { ToolAxis } from "./tools";
import "./robot_panel.css";

const WIRE = "robot_state";

export default function RobotPanel(props: PanelProps) {
  const { object, reach, stopWithout, members, definitions, scope, place, settings, change } = props;
  const isRobot = members.some(({ name }) => name === WIRE) && members.some(({ name }) => name === "jog_joint");
  const look = useFeed(object, isRobot ? "wire" : null, WIRE);
  const state = readState(look.value);
  const { info, failure: unknown } = useRobotInfo(object, isRobot);
  const joints = useMemo(() => jointsOf(info), [info]);
  const tools = useMemo(() => toolsOf(info), [info]);
  const [failure, setFailure] = useState<string | null>(null);
  const [halted, setHalted] = useState<string | null>(null);
  const acting = useAction();
  const { control, last, isOpen } = useControl(object);
  const changing = useMemo(() => new CommandMode(), []);
  useEffect(() => () => changing.leave(), [object, changing]);
  const percent = numberIn(settings, "percent", 10, 0, 100);
  if (!isRobot) return <p class="note">{t("This object is no robot of the standard types.")}</p>;

  const isNow = isFresh(look, object);
  const age = look.stale === null ? "" : "is-stale";
  const mode = state ? modeName(state.commandMode, "RobotCommandMode", definitions, scope) : "";
  const beginJog = (): void => acting.run(async () => void (object && (await changing.change(object, control, 1))));
  const haltAll = (): void => {
    setFailure(null);
    setHalted(null);
    if (reach) {
      const fail = (error: unknown): void => setFailure(explain(error));
      return void passOn(stopDevice(reach, ROBOT_STOP, fail), stopWithout).then((how) => setHalted(how ?? null), fail);
    }
    tellStop();
    setHalted(t("sent, no answer yet"));
    stopWithout().then(setHalted, (error: unknown) => {
      setHalted(null);
      setFailure(t("NOT STOPPED: {0}", explain(error)));
    });
  };
  const positions = state?.positions ?? new Float64Array();
  /** `speed`: of what may be, 0 to 1, with a sign. */
  const jogJoint = (way: "call" | "urgent", index: number, speed: number): Promise<unknown> => {
    const velocity = new Float64Array(positions.length);
    velocity[index] = speed * (joints[index]?.fastest || 1);
    return reach?.[way]("jog_joint", [velocity, JOG_SECONDS, false], { timeout: 2000 }) ?? Promise.resolve();
  };
  const jogTool = (way: "call" | "urgent", chain: number, axis: ToolAxis, speed: number): Promise<unknown> => {
    const velocity = velocityAlong(axis, speed * (tools[chain]?.fastest[axis] ?? 0));
    const velocities = new Map([[chain, velocity]]);
    return reach?.[way]("jog_cartesian", [velocities, JOG_SECONDS, false], { timeout: 2000 }) ?? Promise.resolve();
  };
  type Jog = (way: "call" | "urgent", speed: number) => Promise<unknown>;
  const jogBy = async (jog: Jog, direction: number, isHeld: () => boolean): Promise<void> => {
    await control?.begin();
    if (isHeld()) await jog("call", (direction * percent) / 100);
  };
  const mayGoOn = (): boolean => control?.mayCommand !== false; // a hand that still holds a button takes nothing back
  const halt = (jog: Jog): Promise<unknown> =>
    reach ? stopNow(reach, false, () => jog("urgent", 0)) : Promise.resolve();
  const canJog = isNow && isOpen && mode === "jog" && info !== undefined;
  return (
    <div class="robot-panel panel-scroll">
      <ul class={`robot-words ${age}`} aria-label={t("State")}>
        {stateWords(state, definitions, scope).map(({ text, kind }) => (
          <li key={text} class={`word-${kind}`}>
            {text}
          </li>
        ))}
      </ul>
      <div class="row-line" role="group" aria-label={t("Mode")}>
        <button
          class="button"
          type="button"
          aria-pressed={isNow && mode === "halt"}
          onPointerDown={(event) => event.button === 0 && haltAll()}
          onClick={(event) => event.detail === 0 && haltAll()}
        >
          {t("Halt")}
        </button>
        <button
          class="button"
          type="button"
          aria-pressed={isNow && mode === "jog"}
          disabled={!object || acting.busy || look.failure !== null}
          onClick={beginJog}
        >
          {t("Jog")}
        </button>
        <label class="jog-speed">
          {t("Speed")}{" "}
          <input
            type="range"
            min={1}
            max={100}
            value={percent}
            onInput={(event) => change({ ...settings, percent: Number(event.currentTarget.value) })}
          />{" "}
          <output>{percent} %</output>
        </label>
      </div>
      <ControlLine control={last} isThere={object !== null} place={place} />
      <p class="note" role="status" hidden={halted === null}>
        {halted}
      </p>
      <Failure text={failure ?? acting.failure ?? unknown} />
      <ol class={`joints ${age}`}>
        {Array.from(positions, (position, i) => {
          const joint = joints[i] ?? { name: t("Joint {0}", i + 1), unit: "", low: NaN, high: NaN, fastest: 1 };
          const jog: Jog = (way, speed) => jogJoint(way, i, speed);
          return (
            <li key={i} data-joint={i}>
              <JogRow
                name={joint.name}
                value={position}
                unit={joint.unit}
                digits={4}
                enabled={canJog}
                jog={(direction, isHeld) => jogBy(jog, direction, isHeld)}
                mayGoOn={mayGoOn}
                stop={() => halt(jog)}
                fail={setFailure}
              >
                <JointBar joint={joint} position={position} />
              </JogRow>
            </li>
          );
        })}
      </ol>
      {members.some(({ name }) => name === "jog_cartesian") &&
        tools.map((tool, chain) => {
          const pose = state?.tools[chain];
          return (
            pose && (
              <section key={chain} class={`tool-axes ${age}`} data-tool={tool.name}>
                <h3>{t("Tool of {0}", tool.name)}</h3>
                <ul>
                  {TOOL_AXES.map((axis) => {
                    const jog: Jog = (way, speed) => jogTool(way, chain, axis, speed);
                    return (
                      <li key={axis} data-axis={axis}>
                        <JogRow
                          name={axis}
                          value={coordinateOf(pose, axis)}
                          unit={isTurn(axis) ? "°" : "m"}
                          digits={isTurn(axis) ? 1 : 4}
                          isJogged={tool.isJogged}
                          enabled={canJog}
                          jog={(direction, isHeld) => jogBy(jog, direction, isHeld)}
                          mayGoOn={mayGoOn}
                          stop={() => halt(jog)}
                          fail={setFailure}
                        />
                      </li>
                    );
                  })}
                </ul>
              </section>
            )
          );
        })}
      {!canJog && object && look.failure === null && (
        <p class="note">
          {look.stale !== null
            ? t("No jogging on old values.")
            : info === undefined
              ? t("No jogging before the robot has said how fast it may be.")
              : t("Choose Jog to move the robot by hand.")}
        </p>
      )}
      <Freshness look={look} isLive={object !== null} />
    </div>
  );
}

const JOG_SECONDS = 0.4; // the robot stops by itself when no more commands come

function JointBar({ joint, position }: { joint: Joint; position: number }) {
  const has = Number.isFinite(joint.low) && joint.high > joint.low;
  const [low, high] = has ? [joint.low, joint.high] : [-1, 1];
  const share = has ? Math.min(1, Math.max(0, (position - low) / (high - low))) : 0.5;
  const isNear = has && Math.abs(share - 0.5) > 0.45;
  return (
    <span
      class={`joint-bar ${isNear ? "is-near" : ""}`}
      title={has ? t("{0} to {1}", formatNumber(low), formatNumber(high)) : t("no limits known")}
    >
      <meter class="unseen" aria-label={joint.name} min={low} max={high} value={has ? position : 0} />
      {has && <span class="joint-mark" style={{ left: `${share * 100}%` }} />}
    </span>
  );
}
