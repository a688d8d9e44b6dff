// The robot's play button: the robot asks this page for a song by its callback, and plays what it was given.
// Layer: web/robot_view.

import { useEffect, useState } from "preact/hooks";
import { explain } from "../robot/remote";
import type { Remote } from "../robot/remote";
import { name_notes, song_after } from "../robot/song";

export function SongBox({ robot }: { robot: Remote | null }) {
  const [text, set_text] = useState("");
  const can_play = robot?.has("play_callback", "callback") && robot.has("press_play", "function");
  useEffect(() => {
    if (!robot || !can_play) return;
    return robot.answer("play_callback", (distance) => {
      const song = song_after(Number(distance));
      set_text(`♪ ${name_notes(song)}`);
      return song;
    });
  }, [robot, can_play]);
  if (!robot || !can_play) return null;
  const press = (): void => {
    robot.call("press_play", []).catch((error: unknown) => set_text(`press_play: ${explain(error)}`));
  };
  return (
    <>
      <button class="button button-quiet" type="button" onClick={press}>
        Play a song
      </button>
      <output class="note" aria-label="Song">
        {text}
      </output>
    </>
  );
}
