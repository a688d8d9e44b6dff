// What is loaded once, for whoever wants it first; after a failure, for the next one again. Layer: wasm-client/ts.
import { makeError, textOf } from "./errors.js";

export class Once<T> {
  #begun: Promise<T> | undefined;

  /** `failure`: what did not work, where `load` rejects. */
  constructor(
    private readonly load: () => Promise<T>,
    private readonly failure: string,
  ) {}

  get isBegun(): boolean {
    return this.#begun !== undefined;
  }

  /** @throws RobotRaconteurError (rejects) SystemResourceError: it cannot be loaded; a later call tries again. */
  get(): Promise<T> {
    return (this.#begun ??= this.load().catch((error: unknown) => {
      this.#begun = undefined;
      throw makeError("SystemResourceError", `${this.failure}: ${textOf(error)}`);
    }));
  }
}
