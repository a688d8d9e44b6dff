// The controls: four directions and stop, to hold with mouse, fingers or keys, and the speed.
// Layer: web/robot_view.

import { useEffect, useState } from "preact/hooks";
import { t } from "../app/language";
import type { Control } from "../robot/control";
import type { Driver } from "../robot/driver";
import { isLeftUp } from "../robot/let_go";
import { SPEED_MAX, SPEED_MIN } from "../robot/steering";
import type { Direction, DriveCommand } from "../robot/steering";
import { useDriving } from "../robot/use_driving";
import type { Driving } from "../robot/use_driving";
import { ControlLine, useControlKind } from "../ui/control_line";
import { Failure } from "../ui/failure";
import { ArrowIcon } from "../ui/icons";
import "./pad.css";

export interface DrivePanelProps {
  driver: Driver<DriveCommand>;
  control: Control | null;
  enabled: boolean;
  /** False while another view of the robot is. */
  shown: boolean;
  /** Somebody asked for a stop, and there is no connection for it. */
  unsent: () => void;
  lost: boolean;
  failure: string | null;
  device: string;
  service: string;
}

export function DrivePanel({
  driver,
  control,
  enabled,
  shown,
  unsent,
  lost,
  failure,
  device,
  service,
}: DrivePanelProps) {
  const [speed, setSpeed] = useState(200);
  const driving = useDriving(driver, speed, { enabled, shown, unsent });
  const isIdle = useControlKind(control) === "idle";
  useEffect(() => {
    if (isIdle) driving.letGo(); // what is held when control is given back drives no more
  }, [isIdle]);
  return (
    <section class="panel drive" aria-labelledby="drive-title">
      <h2 id="drive-title" class="unseen">
        {t("Drive")}
      </h2>
      <div class="pad" role="group" aria-label={t("Hold to drive")}>
        <HoldButton direction="forward" label={t("Forward")} driving={driving} enabled={enabled} />
        <HoldButton direction="left" label={t("Left")} driving={driving} enabled={enabled} />
        {/* At the press already; a click alone is the keyboard's, or a screen reader's. */}
        <button
          class="pad-stop"
          type="button"
          onPointerDown={(event) => event.button === 0 && driving.stop()}
          onClick={(event) => event.detail === 0 && driving.stop()}
        >
          {t("Stop")}
        </button>
        <HoldButton direction="right" label={t("Right")} driving={driving} enabled={enabled} />
        <HoldButton direction="back" label={t("Back")} driving={driving} enabled={enabled} />
      </div>
      <div class="speed">
        <label for="speed">{t("Speed")}</label>
        <input
          id="speed"
          type="range"
          min={SPEED_MIN}
          max={SPEED_MAX}
          step={10}
          value={speed}
          onInput={(event) => setSpeed(Number(event.currentTarget.value))}
          // The arrows belong to the robot again as soon as the mouse lets go of the slider.
          onPointerUp={(event) => event.currentTarget.blur()}
        />
        <output for="speed">{speed} mm/s</output>
      </div>
      <ControlLine control={control} isThere={!lost} place={{ device, service, object: "" }} />
      <p class="note drive-note">
        {lost
          ? t("Driving is off: no connection to {0}. It comes back by itself.", device)
          : enabled
            ? t("Hold a button, an arrow key or WASD. Letting go stops; so do Space and Esc.")
            : t("Driving is off until the robot is connected.")}
      </p>
      <Failure text={failure} />
    </section>
  );
}

interface HoldButtonProps {
  direction: Direction;
  label: string;
  driving: Driving;
  enabled: boolean;
}

function HoldButton({ direction, label, driving, enabled }: HoldButtonProps) {
  const held = driving.held.has(direction);
  const source = (event: PointerEvent): string => `pointer ${event.pointerId}`;
  const keySource = `button ${direction}`;
  return (
    <button
      class={`pad-button pad-${direction} ${held ? "is-held" : ""}`}
      type="button"
      disabled={!enabled}
      aria-pressed={held}
      onPointerDown={(event) => {
        if (event.button !== 0) return;
        event.currentTarget.setPointerCapture(event.pointerId); // the finger may slide off; letting go is still heard
        driving.press(source(event), direction);
      }}
      onPointerMove={(event) => isLeftUp(event) && driving.release(source(event))}
      onLostPointerCapture={(event) => driving.release(source(event))} // after pointerup and pointercancel alike
      onContextMenu={(event) => event.preventDefault()} // a long touch is driving, not a menu
      onKeyDown={(event) => {
        if (event.code !== "Space" && event.code !== "Enter") return;
        event.preventDefault();
        if (!event.repeat) driving.press(keySource, direction);
      }}
      onKeyUp={() => driving.release(keySource)}
      onBlur={() => driving.release(keySource)}
    >
      <ArrowIcon towards={direction} />
      <span>{label}</span>
    </button>
  );
}
