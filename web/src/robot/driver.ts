// Sends drive commands so that the newest intent wins and a stop is never late.
// Layer: web/robot. A stop goes out at once, past whatever is unanswered. A moving command waits for the answers to all
// others, and a newer one replaces it meanwhile: a robot that answers late is never sent old wishes.

import { isStop, sameCommand, STOP } from "./steering";
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
  #mayMove = false;
  #unanswered = { moves: 0, stops: 0 };
  #repeat: ReturnType<typeof setInterval> | undefined;
  readonly #onError: (error: unknown) => void;

  /** `onError` hears of each command that failed; the driver itself keeps only the wish to stop. */
  constructor(onError: (error: unknown) => void) {
    this.#onError = onError;
  }

  /** A connection came (a function) or went (null). A robot that may still move is told to stop first. */
  setConnection(send: SendDrive | null): void {
    this.#send = send;
    this.#wanted = STOP;
    this.#unanswered = { moves: 0, stops: 0 };
    this.#rest();
    if (this.#mayMove) this.#transmit(STOP);
  }

  /** Sets what the robot should do now. A robot that this page has not moved is not told to stop: others may drive it. */
  want(command: DriveCommand): void {
    if (!this.#send || sameCommand(command, this.#wanted)) return;
    this.#wanted = command;
    if (isStop(command) || this.#isAnswered) this.#transmit(command);
  }

  /** Somebody asked for a stop: sent whoever moves the robot, and again until it is answered. */
  stop(): void {
    if (!this.#send) return;
    this.#wanted = STOP;
    this.#mayMove = true;
    this.#transmit(STOP);
  }

  /** Whether the robot may move by a command of this page's. */
  get isMoving(): boolean {
    return this.#mayMove;
  }

  /** Stops the robot and forgets the connection. */
  dispose(): void {
    this.want(STOP);
    this.setConnection(null);
  }

  get #isAnswered(): boolean {
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
    this.#unanswered[isStop(command) ? "stops" : "moves"] += 1;
    if (!isStop(command)) this.#mayMove = true; // it may, even if the answer never comes
    this.#repeat ??= setInterval(() => this.#isAnswered && this.#transmit(this.#wanted), REPEAT_MS);
    send(command).then(
      () => this.#settle(send, command, null),
      (error: unknown) => this.#settle(send, command, error),
    );
  }

  #settle(send: SendDrive, command: DriveCommand, error: unknown): void {
    if (send !== this.#send) return; // an answer of a connection that is gone
    this.#unanswered[isStop(command) ? "stops" : "moves"] -= 1;
    if (error !== null) {
      this.#wanted = STOP;
      this.#onError(error);
    } else if (isStop(command) && this.#unanswered.moves === 0) {
      this.#mayMove = false;
    }
    if (!this.#isAnswered) return;
    if (isStop(this.#wanted) && !this.#mayMove) this.#rest();
    else if (!sameCommand(this.#sent, this.#wanted)) this.#transmit(this.#wanted);
  }
}
