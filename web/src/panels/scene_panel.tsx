// Poses, frames, point clouds and scans of a value in space, and the joints of a standard robot as a chain, or as its model in
// URDF; frames as numbers, too.
// Layer: web/panels.

import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import { t } from "../app/language";
import { onColoursChanged } from "../app/theme";
import { readPalette } from "../chart/palette";
import { useFeed } from "../live/use_feed";
import { explain } from "../robot/remote";
import { Failure } from "../ui/failure";
import { formatNumber } from "../values/format";
import { chainsOf, framesIn, posesOf } from "../values/frames";
import { pointsIn } from "../values/points";
import { jointsOf, readState } from "./joints";
import { membersFor, textIn } from "./panel";
import type { PanelProps } from "./panel";
import { feedKindOf, Freshness, MemberSelect } from "./parts";
import { useRobotInfo } from "./robot_info";
import { Picture } from "./scene";
import { anglesOf, ModelNotes, ModelTools, placed, useModel } from "./scene_model";
import "./scene_panel.css";

const NO_POINTS = new Float32Array();

export default function ScenePanel({ object, members, settings, change }: PanelProps) {
  const choices = membersFor("scene", members);
  const usual = choices.find(({ name }) => name === "robot_state") ?? choices[0];
  const name = textIn(settings, "member") || usual?.name || "";
  const look = useFeed(object, feedKindOf(choices.find((each) => each.name === name)), name);
  const isRobot = members.some((each) => each.name === "robot_info" && each.kind === "property");
  const { info, failure: unknown } = useRobotInfo(object, isRobot);
  const chains = useMemo(() => chainsOf(info), [info]);
  const joints = useMemo(() => jointsOf(info), [info]);
  const { model, failure: noModel } = useModel(object, members, settings);
  const [failure, setFailure] = useState<string | null>(null);
  const canvas = useRef<HTMLCanvasElement>(null);
  const picture = useRef<Picture | null>(null);

  useEffect(() => {
    const element = canvas.current;
    if (!element) return;
    try {
      picture.current = new Picture(element);
    } catch (error) {
      setFailure(t("This browser draws no 3-D pictures: {0}", explain(error)));
      return;
    }
    const colour = (): void => picture.current?.colour(readPalette(element));
    colour();
    const unwatch = onColoursChanged(colour);
    return () => {
      unwatch();
      picture.current?.dispose();
      picture.current = null;
    };
  }, []);

  const { carried, frames, points, positions } = useMemo(() => {
    const points = pointsIn(look.value);
    const positions = readState(look.value)?.positions;
    return {
      positions,
      carried: positions?.length ? chains.map((chain) => ({ name: chain.name, poses: posesOf(chain, positions) })) : [],
      frames: points ? [] : framesIn(look.value), // a header's pose is the sensor's, and a cloud may have as many as points
      points,
    };
  }, [look.value, chains]);
  // A robot whose joints are not known is not where its model is at zero.
  const isPosed = (info !== undefined || !isRobot) && joints.length <= (positions?.length ?? 0);
  const posed = isPosed ? model : null;
  const { bodies, bones, links } = useMemo(
    () => placed(posed, anglesOf(joints, positions)),
    [positions, joints, posed],
  );
  const tips = carried.flatMap(({ name, poses }) => poses.slice(-1).map((pose) => ({ name, pose })));
  useEffect(() => {
    const chains = carried.map(({ poses }) => poses);
    if (posed) picture.current?.show(bones, [...tips, ...frames], bodies);
    else picture.current?.show(chains, frames, []);
  }, [carried, frames, bodies]);
  useEffect(() => picture.current?.showPoints(points ?? NO_POINTS), [points]);
  const told = [...tips, ...frames, ...links];

  return (
    <div class="scene-panel">
      <div class="panel-tools">
        <MemberSelect members={choices} chosen={name} choose={(next) => change({ ...settings, member: next })} />
        <button class="button button-quiet" type="button" onClick={() => picture.current?.look("corner")}>
          {t("Whole")}
        </button>
        <button class="button button-quiet" type="button" onClick={() => picture.current?.look("above")}>
          {t("From above")}
        </button>
        <button class="button button-quiet" type="button" onClick={() => picture.current?.look("front")}>
          {t("From the front")}
        </button>
        <button class="button button-quiet" type="button" onClick={() => picture.current?.look("side")}>
          {t("From the side")}
        </button>
        <ModelTools members={members} settings={settings} change={change} />
      </div>
      <Failure text={failure ?? unknown ?? noModel} />
      <canvas
        ref={canvas}
        class={`scene ${look.stale === null ? "" : "is-stale"}`}
        role="img"
        aria-label={t("{0} in space", name)}
      />
      <p class="note two-fingers">{t("Two fingers turn and zoom.")}</p>
      <ModelNotes model={model} joints={joints} />
      {points && <p class="note">{t("{0} points", formatNumber(points.length / 3))}</p>}
      <details class="frames">
        <summary>{told.length === 1 ? t("1 frame") : t("{0} frames", told.length)}</summary>
        <ul>
          {told.map((frame) => (
            <li key={frame.name} data-frame={frame.name}>
              {frame.name}: {frame.pose.at.map((each) => each.toFixed(3)).join(" ")} m
            </li>
          ))}
        </ul>
      </details>
      <Freshness look={look} isLive={object !== null} />
    </div>
  );
}
