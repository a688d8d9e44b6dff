// What controls a replay: where it is, play and pause, step, speed, and going to another time.
// Layer: web/pages. Source: robdef/org.rrgate.replay.robdef.

import { useEffect, useState } from "preact/hooks";
import { t } from "../app/language";
import type { DeviceList } from "../gateway/devices";
import { count, isRecord } from "../gateway/fields";
import { useObject } from "../live/links";
import { useFeed } from "../live/use_feed";
import { useAction } from "../members/row";
import type { Link } from "../robot/link";
import { Failure } from "../ui/failure";
import { timeText } from "../ui/words";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10];

export interface ReplayControlsProps {
  link: Link;
  /** The service that controls, as "device/service". */
  from: string;
  list: DeviceList;
}

export default function ReplayControls({ link, from, list }: ReplayControlsProps) {
  const { object, failure } = useObject(link, from, "", list);
  const look = useFeed(object, "wire", "state");
  const action = useAction();
  const [held, setHeld] = useState<number | null>(null); // by the slider, until the replay is there
  useEffect(() => setHeld(null), [object]); // Firefox tells no end of a drag whose slider was switched off meanwhile
  const state = readState(look.value);
  if (!state) return <Failure text={failure ?? look.failure} />;
  const { isPlaying, duration, speed, loops } = state;
  const isOff = object === null;
  const position = (isOff ? null : held) ?? state.position;
  const call = (name: string, ...args: unknown[]): void =>
    action.run(async () => void (await object?.call(name, args)));
  const set = (name: string, value: unknown): void => action.run(async () => void (await object?.set(name, value)));
  const seek = (seconds: number): void =>
    action.run(async () => {
      try {
        await object?.call("seek", [seconds]);
      } finally {
        setHeld(null);
      }
    });
  return (
    <section class="replay-bar" aria-label={t("Replay")}>
      <button class="button" type="button" disabled={isOff} onClick={() => call(isPlaying ? "pause" : "play")}>
        {isPlaying ? t("Pause") : t("Play")}
      </button>
      <button class="button" type="button" disabled={isOff} onClick={() => call("step", 1)}>
        {t("Step")}
      </button>
      <input
        class="replay-time"
        type="range"
        aria-label={t("Time of the recording")}
        aria-valuetext={timeText(position)}
        min={0}
        max={duration}
        step="any"
        value={position}
        disabled={isOff}
        onInput={(event) => setHeld(Number(event.currentTarget.value))}
        onChange={(event) => seek(Number(event.currentTarget.value))}
      />
      <output>
        {timeText(position)} / {timeText(duration)}
      </output>
      <label>
        {t("Speed")}{" "}
        <select
          class="field"
          value={String(speed)}
          disabled={isOff}
          onChange={(event) => set("speed", Number(event.currentTarget.value))}
        >
          {[...new Set([...SPEEDS, speed])]
            .sort((a, b) => a - b)
            .map((each) => (
              <option key={each} value={String(each)}>
                {each}×
              </option>
            ))}
        </select>
      </label>
      <label>
        <input
          type="checkbox"
          checked={loops}
          disabled={isOff}
          onChange={(event) => set("loop", event.currentTarget.checked)}
        />{" "}
        {t("Repeat")}
      </label>
      <Failure text={action.failure ?? failure} />
    </section>
  );
}

interface ReplayState {
  isPlaying: boolean;
  /** In seconds since the first message. */
  position: number;
  duration: number;
  speed: number;
  loops: boolean;
}

function readState(value: unknown): ReplayState | null {
  if (!isRecord(value)) return null;
  return {
    isPlaying: value["playing"] === true,
    position: count(value["position"]),
    duration: count(value["duration"]),
    speed: count(value["speed"]),
    loops: value["loop"] === true,
  };
}
