// Which directions are held, by how many fingers and keys.
// Layer: web/robot, pure. Each source (a key, a pointer) holds one direction; a direction counts while any source holds it.

import type { Direction } from "./steering";

export class Holds {
  readonly #bySource = new Map<string, Direction>();

  press(source: string, direction: Direction): void {
    this.#bySource.set(source, direction);
  }

  release(source: string): void {
    this.#bySource.delete(source);
  }

  /** Lets go of everything: the window lost focus, the connection went, somebody pressed stop. */
  clear(): void {
    this.#bySource.clear();
  }

  get directions(): ReadonlySet<Direction> {
    return new Set(this.#bySource.values());
  }
}
