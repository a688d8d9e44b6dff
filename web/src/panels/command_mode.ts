// Changing the command mode of a standard robot, in steps: no step follows a stop, or the end of the panel that began it.
// Layer: web/panels, pure. Source: com.robotraconteur.robotics.robot, command_mode.

import { watchStop } from "../robot/control";
import type { Control } from "../robot/control";
import type { Remote } from "../robot/remote";

const HALT = 0;

export class CommandMode {
  #left = 0;

  /** The panel is gone, or shows another object: what is under way ends with its present step. */
  leave(): void {
    this.#left += 1;
  }

  /**
   * Takes the right to command, and changes the mode.
   * @returns whether the robot may be commanded further: nobody has asked for a stop, left, or given the right back.
   * @throws (rejects) with what the gateway or the robot refuses.
   */
  async change(
    object: Pick<Remote, "set">,
    control: Pick<Control, "begin" | "mayCommand"> | null,
    mode: number | bigint,
  ): Promise<boolean> {
    const isStopped = watchStop();
    const before = this.#left;
    const mayGoOn = (): boolean => !isStopped() && this.#left === before && control?.mayCommand !== false;
    await control?.begin();
    if (!mayGoOn()) return false;
    await object.set("command_mode", HALT); // a robot changes its mode only from there
    if (!mayGoOn()) return false;
    await object.set("command_mode", mode);
    return mayGoOn();
  }
}
