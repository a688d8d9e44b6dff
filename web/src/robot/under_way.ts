// Commands of one connection that have been sent and not answered yet: a stop that goes past them may arrive before them.
// Layer: web/robot, pure.

export class UnderWay {
  readonly #commands = new Set<Promise<void>>();

  /** @returns the command as it is. */
  follow<T>(command: Promise<T>): Promise<T> {
    const forget = (): void => void this.#commands.delete(done);
    const done: Promise<void> = command.then(forget, forget);
    this.#commands.add(done);
    return command;
  }

  /** Settles once all that are under way now were answered or failed; null where there is none. */
  settled(): Promise<unknown> | null {
    return this.#commands.size === 0 ? null : Promise.all(this.#commands);
  }
}
