// The demo robot: chart, controls, live values, bump log, camera.
// Layer: web/pages. What is known of the robot outlives its connections; see RobotModel.

import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import { t } from "../app/language";
import { useStore } from "../app/store";
import { stopWithout, useSafe } from "../board/stop";
import { CameraView } from "../camera/camera_view";
import { RobotChart } from "../chart/robot_chart";
import { isReplay } from "../gateway/devices";
import type { DeviceList } from "../gateway/devices";
import { stopNow } from "../robot/control";
import { Driver, DRIVE_TIMEOUT_MS } from "../robot/driver";
import { openIn } from "../robot/link";
import type { Link } from "../robot/link";
import { explain } from "../robot/remote";
import type { Remote } from "../robot/remote";
import { RobotModel } from "../robot/robot_model";
import { sameCommand, STOP } from "../robot/steering";
import type { DriveCommand } from "../robot/steering";
import { passOn } from "../robot/stop";
import { BumpLog } from "../robot_view/bump_log";
import { DrivePanel } from "../robot_view/drive_panel";
import { PoseLine } from "../robot_view/pose_line";
import { SongBox } from "../robot_view/song_box";
import { ValuesPanel } from "../robot_view/values_panel";
import { useControl } from "../ui/control_line";
import { useAge } from "../ui/use_age";
import "./robot_page.css";

export interface RobotPageProps {
  link: Link;
  list: DeviceList;
  device: string;
  service: string;
  /** False while another view of the same robot is shown: the model follows on, driving does not. */
  shown: boolean;
}

export default function RobotPage({ link, list, device, service, shown }: RobotPageProps) {
  const state = useStore(link.state);
  const remote = state.kind === "online" ? state.remote : null;
  const reach = openIn(state); // a stop also goes to a robot that is only said to be away
  const safe = useSafe({ device, service }, list);
  const without = (cause?: unknown): Promise<string> => stopWithout({ device, service }, safe, cause);
  // The view that is shown has a stop of its own.
  const latest = useRef<typeof without | null>(null);
  latest.current = shown ? without : null;
  const isRecorded = isReplay(device); // nothing moves it, and what there is now was not there
  const model = useMemo(() => new RobotModel({ isRecorded }), [isRecorded]);
  const [driveFailure, setDriveFailure] = useState<string | null>(null);
  const { control, last, isOpen } = useControl(reach);
  const driver = useMemo(() => {
    const onError = (error: unknown): void => setDriveFailure(`Drive: ${explain(error)}`);
    return new Driver({ rest: STOP, same: sameCommand, onError });
  }, []);

  useEffect(() => {
    if (!remote) return;
    const stop = new AbortController();
    model.attach(remote, stop.signal);
    return () => stop.abort();
  }, [remote, model]);

  useEffect(() => {
    if (!reach || !control) return;
    setDriveFailure(null);
    const send = async (command: DriveCommand, insists: boolean): Promise<void> => {
      const given = [command.velocity, command.radius];
      if (!sameCommand(command, STOP)) {
        await reach.call("Drive", given, { timeout: DRIVE_TIMEOUT_MS });
        return setDriveFailure(null);
      }
      const stop = stopNow(reach, insists, () => reach.urgent("Drive", given, { timeout: DRIVE_TIMEOUT_MS }));
      const passed = insists && latest.current ? passOn(stop, latest.current) : stop;
      setDriveFailure((await passed) ?? null);
    };
    driver.setConnection({ send, right: control });
    return () => driver.dispose();
  }, [reach, control, driver]);

  const stopUnconnected = (): void => {
    if (!shown) return;
    setDriveFailure(t("sent, no answer yet"));
    without().then(setDriveFailure, (error: unknown) => setDriveFailure(t("NOT STOPPED: {0}", explain(error))));
  };

  const live = remote !== null;
  const poseAge = useAge(() => model.heardAt("pose"));
  const poseComes = live && poseAge === null;
  const putBack = (robot: Remote): void => {
    robot.call("reset", []).catch((error: unknown) => setDriveFailure(`reset: ${explain(error)}`));
  };
  return (
    <div class={`robot ${isRecorded ? "is-recorded" : ""}`}>
      <section class={`panel chart-panel ${poseComes ? "" : "is-stale"}`} aria-labelledby="chart-title">
        <h2 id="chart-title" class="unseen">
          {t("Chart")}
        </h2>
        <RobotChart model={model} live={poseComes} />
        {poseAge !== null && <p class="chart-age">{t("Last known, {0}", poseAge)}</p>}
        <div class="chart-foot">
          <PoseLine model={model} live={live} />
          {!isRecorded && remote?.has("reset", "function") && (
            <button class="button button-quiet" type="button" onClick={() => putBack(remote)}>
              {t("To start")}
            </button>
          )}
          <button class="button button-quiet" type="button" onClick={() => model.clearTrail()}>
            {t("Clear trail")}
          </button>
          {!isRecorded && <SongBox robot={remote} />}
        </div>
      </section>
      {!isRecorded && (
        <div class="robot-side">
          <DrivePanel
            driver={driver}
            control={last}
            enabled={live && shown && isOpen}
            shown={shown}
            unsent={stopUnconnected}
            lost={state.kind === "lost"}
            failure={driveFailure}
            device={device}
            service={service}
          />
          <CameraView list={list} robot={device} shown={shown} />
        </div>
      )}
      <ValuesPanel model={model} live={live} />
      <BumpLog model={model} />
    </div>
  );
}
