// Sends drive commands so that the newest intent wins and a stop is never late.
// Layer: web/robot. A stop goes out at once, past whatever is unanswered. A moving command waits for the answers to all
// others, and a newer one replaces it meanwhile: a robot that answers late is never sent old wishes.

import { is_stop, same_command, STOP } from "./steering";
import type { DriveCommand } from "./steering";

/** Settles when the robot has answered, or after DRIVE_TIMEOUT_MS. */
export type SendDrive = (command: DriveCommand) => Promise<void>;

export const DRIVE_TIMEOUT_MS = 2_000;
const REPEAT_MS = 400; // what is held is repeated, for a device that stops by itself when commands cease

export class Driver {
  #send: SendDrive | null = null;
  #wanted: DriveCommand = STOP;
  #sent: DriveCommand = STOP;
  /** From a moving command on, until a stop is answered while no moving command is under way. */
  #may_move = false;
  #unanswered = { moves: 0, stops: 0 };
  #repeat: ReturnType<typeof setInterval> | undefined;
  readonly #on_error: (error: unknown) => void;

  /** `on_error` hears of each command that failed; the driver itself keeps only the wish to stop. */
  constructor(on_error: (error: unknown) => void) {
    this.#on_error = on_error;
  }

  /** A connection came (a function) or went (null). A robot that may still move is told to stop first. */
  set_connection(send: SendDrive | null): void {
    this.#send = send;
    this.#wanted = STOP;
    this.#unanswered = { moves: 0, stops: 0 };
    this.#rest();
    if (this.#may_move) this.#transmit(STOP);
  }

  /** Sets what the robot should do now. A robot that this page has not moved is not told to stop: others may drive it. */
  want(command: DriveCommand): void {
    if (!this.#send || same_command(command, this.#wanted)) return;
    this.#wanted = command;
    if (is_stop(command) || this.#is_answered) this.#transmit(command);
  }

  /** Somebody asked for a stop: sent whoever moves the robot, and again until it is answered. */
  stop(): void {
    if (!this.#send) return;
    this.#wanted = STOP;
    this.#may_move = true;
    this.#transmit(STOP);
  }

  /** Whether the robot may move by a command of this page's. */
  get is_moving(): boolean {
    return this.#may_move;
  }

  /** Stops the robot and forgets the connection. */
  dispose(): void {
    this.want(STOP);
    this.set_connection(null);
  }

  get #is_answered(): boolean {
    return this.#unanswered.moves + this.#unanswered.stops === 0;
  }

  #rest(): void {
    clearInterval(this.#repeat);
    this.#repeat = undefined;
  }

  #transmit(command: DriveCommand): void {
    const send = this.#send;
    if (!send) return;
    this.#sent = command;
    this.#unanswered[is_stop(command) ? "stops" : "moves"] += 1;
    if (!is_stop(command)) this.#may_move = true; // it may, even if the answer never comes
    this.#repeat ??= setInterval(() => this.#is_answered && this.#transmit(this.#wanted), REPEAT_MS);
    send(command).then(
      () => this.#settle(send, command, null),
      (error: unknown) => this.#settle(send, command, error),
    );
  }

  #settle(send: SendDrive, command: DriveCommand, error: unknown): void {
    if (send !== this.#send) return; // an answer of a connection that is gone
    this.#unanswered[is_stop(command) ? "stops" : "moves"] -= 1;
    if (error !== null) {
      this.#wanted = STOP;
      this.#on_error(error);
    } else if (is_stop(command) && this.#unanswered.moves === 0) {
      this.#may_move = false;
    }
    if (!this.#is_answered) return;
    if (is_stop(this.#wanted) && !this.#may_move) this.#rest();
    else if (!same_command(this.#sent, this.#wanted)) this.#transmit(this.#wanted);
  }
}
