// A run of a generator function, and how far it has come: stopped is what the device has said to be stopped.
// Layer: web/panels, pure. A stop goes out at once; the client rejects the step under way with OperationAborted.

import { ErrorCode, RobotRaconteurError } from "rrgate-client";
import { t } from "../app/language";
import { Store } from "../app/store";
import { isLocked } from "../robot/control";
import { explain } from "../robot/remote";

export type RunState = "ready" | "stepping" | "running" | "held" | "stopping" | "ended" | "stopped" | "not stopped";
type Values = AsyncGenerator<unknown, void, unknown>;

export class GeneratorRun {
  readonly state = new Store<RunState>("ready");
  readonly failure = new Store<string | null>(null);
  /** It failed because this page does not have the right to command. */
  isLocked = false;
  readonly #heard: (value: unknown) => void;
  #values: Values | null = null;
  #goesOn = false;

  constructor(heard: (value: unknown) => void) {
    this.#heard = heard;
  }

  get isFresh(): boolean {
    return this.#values === null;
  }

  /** A step, or one after another until it ends or is stopped. `given`: what the device is told with each. */
  async go(byItself: boolean, begin: () => Values, given: () => unknown): Promise<void> {
    this.isLocked = false;
    this.failure.value = null;
    this.#goesOn = byItself;
    this.state.value = byItself ? "running" : "stepping";
    let mine: Values | null = null;
    try {
      mine = this.#values ??= begin();
      do {
        const next = await mine.next(given());
        if (this.#values !== mine) return;
        if (next.done) return this.#isStopping ? undefined : this.#end("ended");
        this.#heard(next.value);
      } while (this.#goesOn);
      if (!this.#isStopping) this.state.value = "held";
    } catch (error) {
      if (this.#values !== mine || (this.#isStopping && isAborted(error))) return;
      this.isLocked = isLocked(error);
      this.failure.value = explain(error);
      if (this.#isStopping) return;
      this.#end("ended");
      mine?.return().catch(() => undefined); // what failed on this side may still run there
    }
  }

  /** Takes no further step, and tells the device. */
  async stop(): Promise<void> {
    const mine = this.#values;
    if (!mine || this.#isStopping) return;
    this.#goesOn = false;
    this.state.value = "stopping";
    try {
      await mine.return();
      if (this.#values === mine) this.#end(this.failure.value === null ? "stopped" : "ended");
    } catch (error) {
      if (this.#values !== mine) return;
      this.failure.value = explain(error);
      this.#end("not stopped");
    }
  }

  /** The connection is gone, or nobody looks any more. */
  leave(): void {
    const mine = this.#values;
    this.#goesOn = false;
    if (!mine) return;
    this.#end("not stopped");
    this.failure.value = t("the connection is gone: it may still run");
    mine.return().catch(() => undefined); // nobody is there to be told
  }

  get #isStopping(): boolean {
    return this.state.value === "stopping";
  }

  #end(state: RunState): void {
    this.#values = null;
    this.#goesOn = false;
    this.state.value = state;
  }
}

function isAborted(error: unknown): boolean {
  return error instanceof RobotRaconteurError && error.code === ErrorCode.OperationAborted;
}
