// How many come in a second, by what came in the last two: whether they come one by one or in bursts.
// Layer: web/live, pure.

const WINDOW_MS = 2_000;
const SLOT_MS = 250;
const SHORTEST_MS = 500; // less says nothing about a second
const FEWEST = 3;

/** What came close together; what is measured reaches from the end of one slot to the end of another. */
interface Slot {
  begin: number;
  end: number;
  /** Later ones than `begin` + this belong to the next. */
  lengthMs: number;
  count: number;
}

/** As long for what is nearly ten as for ten: texts beside it stay where they are. */
export const formatRate = (perSecond: number): string => perSecond.toFixed(perSecond < 9.95 ? 1 : 0);

export class Rate {
  readonly #slots: Slot[] = [];

  /** `isAfterGap`: how long nothing came counts for nothing, nor does what had piled up meanwhile. */
  hear(now: number, isAfterGap: boolean): void {
    const slots = this.#slots;
    if (isAfterGap && now - (slots.at(-1)?.end ?? now) > WINDOW_MS) slots.length = 0;
    const last = slots.at(-1);
    if (last && now - last.begin < last.lengthMs) {
      last.end = now;
      last.count++;
    } else {
      slots.push({ begin: now, end: now, lengthMs: last ? SLOT_MS : SHORTEST_MS, count: 1 });
    }
    // The oldest that stays is the newest of those that are older than the window.
    while (slots.length > FEWEST && (slots[1]?.end ?? now) <= now - WINDOW_MS) slots.shift();
  }

  /** Null while too little has come to tell. What is in the first slot came in a time that nobody knows. */
  get perSecond(): number | null {
    const [first, ...others] = this.#slots;
    const ms = (others.at(-1)?.end ?? 0) - (first?.end ?? 0);
    return first && ms >= SHORTEST_MS ? (others.reduce((sum, { count }) => sum + count, 0) * 1000) / ms : null;
  }
}
