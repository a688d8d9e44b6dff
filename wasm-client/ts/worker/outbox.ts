// What waits for the page. It takes one batch at a time, so that what comes while it is busy waits here, where newer values of
// wires replace older ones and the rest is counted. Layer: wasm-client/ts/worker.
import type { HostEvent } from "./messages.js";
import { weigh } from "./passage.js";
import type { Cargo } from "./passage.js";

/** Of one batch: a loop of the page that is as fast as its pipe is behind by no more. */
const batchLimit = 256;
const batchBytes = 1024 * 1024;

/** What waits of one line. */
export interface Waiting {
  count: number;
  size: number;
}

interface Item {
  event: HostEvent;
  cargo: Cargo;
  line: string | undefined;
}

export class Outbox {
  #items: Item[] = [];
  readonly #lines = new Map<string, Waiting>();
  /** Of those lines that keep the newest alone, the item that may be replaced. */
  readonly #newest = new Map<string, Item>();

  get isEmpty(): boolean {
    return this.#items.length === 0;
  }

  /** @returns what waits of `line` now: all items of that name. */
  push(event: HostEvent, line?: string): Waiting {
    return this.#add({ event, cargo: weigh(event), line });
  }

  /** @returns whether it has replaced an older one of its line. */
  pushNewest(event: HostEvent, line: string): boolean {
    const cargo = weigh(event);
    const older = this.#newest.get(line);
    if (older) {
      const waiting = this.#lines.get(line);
      if (waiting) waiting.size += cargo.size - older.cargo.size;
      Object.assign(older, { event, cargo });
      return true;
    }
    const item: Item = { event, cargo, line };
    this.#newest.set(line, item);
    this.#add(item);
    return false;
  }

  /** What comes next on `line` replaces nothing that is there. */
  keep(line: string): void {
    this.#newest.delete(line);
  }

  /** The next batch; without items there may be other news. */
  take(): { events: HostEvent[]; cargo: Cargo } {
    const cargo: Cargo = { transfer: [], marks: [], size: 0 };
    let count = 0;
    for (const item of this.#items) {
      if (count === batchLimit || cargo.size > batchBytes) break;
      ++count;
      cargo.size += item.cargo.size;
      for (const buffer of item.cargo.transfer) cargo.transfer.push(buffer);
      for (const mark of item.cargo.marks) cargo.marks.push(mark);
      this.#leave(item);
    }
    return { events: this.#items.splice(0, count).map(({ event }) => event), cargo };
  }

  #add(item: Item): Waiting {
    this.#items.push(item);
    if (item.line === undefined) return { count: 0, size: 0 };
    const waiting = this.#lines.get(item.line) ?? { count: 0, size: 0 };
    this.#lines.set(item.line, waiting);
    ++waiting.count;
    waiting.size += item.cargo.size;
    return waiting;
  }

  #leave(item: Item): void {
    const { line, cargo } = item;
    if (line === undefined) return;
    if (this.#newest.get(line) === item) this.#newest.delete(line);
    const waiting = this.#lines.get(line);
    if (!waiting) return;
    waiting.size -= cargo.size;
    if (--waiting.count === 0) this.#lines.delete(line);
  }
}
