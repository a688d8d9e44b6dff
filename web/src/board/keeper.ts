// Writes what changes with every movement of a finger at once, and then not more often than browsers allow an address to change.
// Layer: web/board, pure.

import { Store } from "../app/store";

const APART_MS = 400; // WebKit: 100 changes of an address in 30 s

export interface Write {
  /** To this browser's storage. */
  store: () => void;
  /** To the address of the page, while it is the one of this board. */
  show: () => void;
}

export class Keeper {
  /** Whether all is written. */
  readonly isKept = new Store(true);
  #pending: Write | null = null;
  #timer: ReturnType<typeof setTimeout> | undefined;

  /** The newest replaces those that wait. */
  write(write: Write): void {
    this.#pending = write;
    this.isKept.value = false;
    if (this.#timer === undefined) this.flush(true);
  }

  /** Writes now. `isHere`: whether the address is still that of the board. */
  flush(isHere: boolean): void {
    clearTimeout(this.#timer);
    const write = this.#pending;
    this.#pending = null;
    this.#timer = write ? setTimeout(() => this.flush(true), APART_MS) : undefined;
    write?.store();
    if (isHere) write?.show();
    this.isKept.value = true;
  }
}
