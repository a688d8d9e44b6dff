// Sends drive commands so that the newest intent wins and a stop is never late.
// Layer: web/robot. A stop goes out at once, past whatever is unanswered. A moving command waits for the answers to all
// others, and a newer one replaces it meanwhile: a robot that answers late is never sent old wishes.

import { ErrorCode, RobotRaconteurError } from "rrgate-client";

/** Settles when the robot has answered, or after DRIVE_TIMEOUT_MS. `insists`: somebody asked for a stop, whoever moves the robot. */
export type Send<Command> = (command: Command, insists: boolean) => Promise<void>;

export interface Means<Command> {
  send: Send<Command>;
  /** The right to command, which moving needs and stopping does not. */
  right?: { readonly mayCommand: boolean; begin: () => Promise<void> };
}

export interface DriverOptions<Command> {
  /** What stops. */
  rest: Command;
  same: (a: Command, b: Command) => boolean;
  /** Hears of each command that failed; the driver itself keeps only the wish to stop. */
  onError: (error: unknown) => void;
  /** What is held is repeated, for a device that stops by itself when commands cease. */
  repeatMs?: number;
}

export const DRIVE_TIMEOUT_MS = 2_000;
const REPEAT_MS = 400;

export class Driver<Command> {
  #means: Means<Command> | null = null;
  #wanted: Command;
  #sent: Command;
  /** From a moving command on, until a stop is answered while no moving command is under way. */
  #mayMove = false;
  /** Meanwhile a moving command was carried out, or may have been. */
  #hasMoved = false;
  #insists = false;
  #unanswered = { moves: 0, stops: 0 };
  #repeat: ReturnType<typeof setInterval> | undefined;
  readonly #options: DriverOptions<Command>;

  constructor(options: DriverOptions<Command>) {
    this.#options = options;
    this.#wanted = this.#sent = options.rest;
  }

  /** A connection came or went (null). A robot that may still move is told to stop first. */
  setConnection(means: Means<Command> | null): void {
    this.#means = means;
    this.#wanted = this.#options.rest;
    if (this.#unanswered.moves > 0) this.#hasMoved = true;
    this.#unanswered = { moves: 0, stops: 0 };
    this.#rest();
    if (this.#mayMove) this.#transmit(this.#options.rest);
  }

  /** Sets what the robot should do now. A robot that this page has not moved is not told to stop: others may drive it. */
  want(command: Command): void {
    if (!this.#means || this.#options.same(command, this.#wanted)) return;
    this.#wanted = command;
    this.#insists = false;
    if (!this.#isStop(command)) this.#move();
    else if (this.#mayMove) this.#transmit(command);
  }

  /**
   * Somebody asked for a stop: sent whoever moves the robot, and again until it is answered. A refusal is an answer,
   * unless this page has moved the robot.
   * @returns false where there is no connection: nothing was sent.
   */
  stop(): boolean {
    if (!this.#means) return false;
    this.#wanted = this.#options.rest;
    this.#insists = this.#mayMove = true;
    this.#transmit(this.#options.rest);
    return true;
  }

  /** Whether the robot may move by a command of this page's. */
  get isMoving(): boolean {
    return this.#mayMove;
  }

  /** Stops the robot and forgets the connection. */
  dispose(): void {
    this.want(this.#options.rest);
    this.setConnection(null);
  }

  get #isAnswered(): boolean {
    return this.#unanswered.moves + this.#unanswered.stops === 0;
  }

  #isStop(command: Command): boolean {
    return this.#options.same(command, this.#options.rest);
  }

  /** Sends what is wanted by then, once this page may and all is answered. */
  #move(): void {
    const means = this.#means;
    if (!means || !this.#isAnswered) return;
    if (!means.right || means.right.mayCommand) return this.#transmit(this.#wanted);
    means.right.begin().then(
      () => means === this.#means && !this.#isStop(this.#wanted) && means.right?.mayCommand && this.#move(),
      (error: unknown) => {
        if (means !== this.#means) return;
        this.#wanted = this.#options.rest;
        this.#options.onError(error);
      },
    );
  }

  #rest(): void {
    clearInterval(this.#repeat);
    this.#repeat = undefined;
  }

  #transmit(command: Command): void {
    const means = this.#means;
    if (!means) return;
    const isStop = this.#isStop(command);
    this.#sent = command;
    this.#unanswered[isStop ? "stops" : "moves"] += 1;
    if (!isStop) this.#mayMove = true; // it may, even if the answer never comes
    this.#repeat ??= setInterval(() => this.#again(), this.#options.repeatMs ?? REPEAT_MS);
    means.send(command, this.#insists).then(
      () => this.#settle(means, isStop, null),
      (error: unknown) => this.#settle(means, isStop, error),
    );
  }

  #again(): void {
    if (!this.#isAnswered) return;
    if (this.#isStop(this.#wanted) || this.#means?.right?.mayCommand !== false) return this.#transmit(this.#wanted);
    if (!this.#isStop(this.#sent)) this.want(this.#options.rest);
    else if (this.#mayMove) this.#transmit(this.#options.rest); // the right to what is wanted is being asked for
  }

  #settle(means: Means<Command>, isStop: boolean, error: unknown): void {
    if (means !== this.#means) return; // an answer of a connection that is gone
    this.#unanswered[isStop ? "stops" : "moves"] -= 1;
    if (error !== null) {
      this.#wanted = this.#options.rest;
      this.#options.onError(error);
    }
    const isRefused = isRefusal(error);
    if (!isStop && !isRefused) this.#hasMoved = true;
    if (isStop && error === null && this.#unanswered.moves === 0) this.#hasMoved = this.#mayMove = false;
    if (isStop && isRefused) this.#insists = false;
    if (isRefused && !this.#hasMoved && this.#unanswered.moves === 0) this.#mayMove = false;
    if (!this.#isAnswered) return;
    if (this.#isStop(this.#wanted) && !this.#mayMove) this.#rest();
    else if (!this.#options.same(this.#sent, this.#wanted))
      if (this.#isStop(this.#wanted)) this.#transmit(this.#wanted);
      else if (this.#isStop(this.#sent) || means.right?.mayCommand !== false) this.#move();
      else this.want(this.#options.rest); // wanted before the right was given back
  }
}

function isRefusal(error: unknown): boolean {
  if (!(error instanceof RobotRaconteurError)) return false;
  return error.code === ErrorCode.PermissionDenied || error.code === ErrorCode.ObjectLockedError;
}
