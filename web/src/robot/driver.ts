// Sends drive commands so that the newest intent wins and a stop is never lost.
// Layer: web/robot. One call is in flight at a time; what was wanted meanwhile replaces what was waiting.

import { is_stop, STOP } from "./steering";
import type { DriveCommand } from "./steering";

export type SendDrive = (command: DriveCommand) => Promise<void>;

const REPEAT_MS = 400; // a held key is repeated, for a device that stops by itself when commands cease

export class Driver {
  #send: SendDrive | null = null;
  #wanted: DriveCommand = STOP;
  #delivered: DriveCommand = STOP; // the last command that may have reached the robot
  #in_flight = false;
  #repeat: ReturnType<typeof setInterval> | undefined;
  readonly #on_error: (error: unknown) => void;

  /** `on_error` hears of each command that failed; the driver itself keeps only the wish to stop. */
  constructor(on_error: (error: unknown) => void) {
    this.#on_error = on_error;
  }

  /** A connection came (a function) or went (null). A robot last told to move is told to stop first. */
  set_connection(send: SendDrive | null): void {
    this.#send = send;
    this.#in_flight = false;
    this.#wanted = STOP;
    this.#hold(false);
    if (send && !is_stop(this.#delivered)) this.#pump();
  }

  /** Sets what the robot should do now. Without a connection only the stop is remembered. */
  want(command: DriveCommand): void {
    if (!this.#send) return;
    const same = command.velocity === this.#wanted.velocity && command.radius === this.#wanted.radius;
    this.#wanted = command;
    this.#hold(!is_stop(command));
    if (!same) this.#pump();
  }

  /** Whether the robot was last told to move, or is wanted to. */
  get is_moving(): boolean {
    return !is_stop(this.#wanted) || !is_stop(this.#delivered);
  }

  /** Stops the robot and forgets the connection. */
  dispose(): void {
    this.want(STOP);
    this.#hold(false);
  }

  #hold(moving: boolean): void {
    clearInterval(this.#repeat);
    this.#repeat = moving ? setInterval(() => this.#pump(), REPEAT_MS) : undefined;
  }

  #pump(): void {
    const send = this.#send;
    if (!send || this.#in_flight) return;
    const command = this.#wanted;
    if (!is_stop(command)) this.#delivered = command; // it may move even if the answer never comes
    this.#in_flight = true;
    send(command).then(
      () => this.#settle(send, command, null),
      (error: unknown) => this.#settle(send, command, error),
    );
  }

  #settle(send: SendDrive, command: DriveCommand, error: unknown): void {
    if (send !== this.#send) return; // an answer of a connection that is gone
    this.#in_flight = false;
    if (error !== null) {
      this.#on_error(error);
      this.#wanted = STOP;
      this.#hold(false);
      if (!is_stop(command)) this.#pump();
      else if (!is_stop(this.#delivered)) this.#repeat = setInterval(() => this.#pump(), REPEAT_MS);
      return;
    }
    this.#delivered = command;
    if (is_stop(command) && is_stop(this.#wanted)) this.#hold(false);
    const changed = command.velocity !== this.#wanted.velocity || command.radius !== this.#wanted.radius;
    if (changed) this.#pump();
  }
}
