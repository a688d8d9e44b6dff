// Writes what changes with every movement of a finger once, when it rests: browsers limit how often an address may change.
// Layer: web/board, pure.

const REST_MS = 500;

export interface Write {
  /** To this browser's storage. */
  store: () => void;
  /** To the address of the page, while it is the one of this board. */
  show: () => void;
}

export class Keeper {
  #pending: Write | null = null;
  #timer: ReturnType<typeof setTimeout> | undefined;

  /** The newest replaces those that wait. */
  later(write: Write): void {
    this.#pending = write;
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.flush(true), REST_MS);
  }

  /** Writes now. `isHere`: whether the address is still that of the board. */
  flush(isHere: boolean): void {
    clearTimeout(this.#timer);
    const write = this.#pending;
    this.#pending = null;
    write?.store();
    if (isHere) write?.show();
  }
}
