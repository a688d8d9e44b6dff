// The robot's play button: the robot asks this page for a song by its callback, and plays what it was given.
// Layer: web/robot_view.

import { useEffect, useState } from "preact/hooks";
import { t } from "../app/language";
import { explain } from "../robot/remote";
import type { Remote } from "../robot/remote";
import { nameNotes, songAfter } from "../robot/song";

export function SongBox({ robot }: { robot: Remote | null }) {
  const [text, setText] = useState("");
  const canPlay = robot?.has("play_callback", "callback") && robot.has("press_play", "function");
  useEffect(() => {
    if (!robot || !canPlay) return;
    return robot.answer("play_callback", (distance) => {
      const song = songAfter(Number(distance));
      setText(`♪ ${nameNotes(song)}`);
      return song;
    });
  }, [robot, canPlay]);
  if (!robot || !canPlay) return null;
  const press = (): void => {
    robot.call("press_play", []).catch((error: unknown) => setText(`press_play: ${explain(error)}`));
  };
  return (
    <>
      <button class="button button-quiet" type="button" onClick={press}>
        {t("Play a song")}
      </button>
      <output class="chart-song" aria-label={t("Song")}>
        {text}
      </output>
    </>
  );
}
