// The last minutes of a few numbers at the same times, for a plot and a file.
// Layer: web/panels, pure.

const MOST = 20_000;

/** null: no number. undefined: not measured at this time, when another one was. */
type Cell = number | null | undefined;

export class Trace {
  #times: number[] = [];
  readonly #columns: Cell[][];
  readonly #most: number;

  /** `sources`: how many are measured at times of their own. */
  constructor(columns: number, sources = 1) {
    this.#columns = Array.from({ length: columns }, () => []);
    this.#most = MOST * Math.max(1, sources);
  }

  #pushed = 0;

  /**
   * `now`: milliseconds of a clock that only grows. What is no finite number is null. `from`, `count`: the columns that were
   * measured.
   */
  push(now: number, values: readonly (number | undefined)[], from = 0, count = this.#columns.length): void {
    this.#pushed++;
    this.#times.push(now);
    this.#columns.forEach((column, i) => {
      const isMeasured = i >= from && i < from + count;
      column.push(isMeasured ? finite(values[i - from]) : undefined);
    });
    if (this.#times.length < this.#most * 1.25) return;
    const over = this.#times.length - this.#most;
    this.#times.splice(0, over);
    for (const column of this.#columns) column.splice(0, over);
  }

  /** What comes next was not measured right after what came last: nulls at its time. */
  breakOff(from = 0, count = this.#columns.length): void {
    const end = this.#times.at(-1);
    if (end !== undefined) this.push(end, [], from, count);
  }

  /** How often something was pushed: the same number, the same window. */
  get pushed(): number {
    return this.#pushed;
  }

  /** The newest `seconds`: times in seconds before the last (0), then the values. */
  window(seconds: number): Cell[][] {
    const end = this.#times[this.#times.length - 1] ?? 0;
    const from = lowerBound(this.#times, end - seconds * 1000);
    return [
      this.#times.slice(from).map((at) => (at - end) / 1000),
      ...this.#columns.map((column) => column.slice(from)),
    ];
  }

  /** All of it, a row for each time. */
  *rows(): Generator<(number | null)[]> {
    const begin = this.#times[0] ?? 0;
    for (let i = 0; i < this.#times.length; i++)
      yield [((this.#times[i] ?? 0) - begin) / 1000, ...this.#columns.map((column) => column[i] ?? null)];
  }
}

function finite(value: number | undefined): number | null {
  return value !== undefined && Number.isFinite(value) ? value : null;
}

/** Where a number stands between two that are none: a line has no length there. null: nowhere. */
export function lonely(column: ArrayLike<Cell>): number[] | null {
  const found: number[] = [];
  let [last, isAlone] = [-1, false]; // the number before, and whether it has none before it
  const end = (): void => void (last >= 0 && isAlone && found.push(last));
  for (let i = 0; i < column.length; i++) {
    const cell = column[i];
    if (cell === undefined) continue;
    if (cell === null) {
      end();
      last = -1;
    } else {
      isAlone = last < 0;
      last = i;
    }
  }
  end();
  return found.length > 0 ? found : null;
}

/** Where the newest measured cell is, at or before `index`; the next one after it where there is none. */
export function measuredAt(column: ArrayLike<Cell>, index: number): number {
  let at = index;
  while (at >= 0 && column[at] === undefined) at--;
  if (at >= 0) return at;
  at = index;
  while (at < column.length && column[at] === undefined) at++;
  return at < column.length ? at : index;
}

export function toCsv(head: readonly string[], trace: Trace): string {
  const lines = [head.map(quote).join(",")];
  for (const row of trace.rows()) lines.push(row.map((value) => (value === null ? "" : String(value))).join(","));
  return `${lines.join("\n")}\n`;
}

/** As RFC 4180 has it; a name never becomes a formula of a spreadsheet. */
function quote(text: string): string {
  const safe = /^[=+\-@]/.test(text) ? `'${text}` : text;
  return /[",\n]/.test(safe) ? `"${safe.replaceAll('"', '""')}"` : safe;
}

function lowerBound(sorted: readonly number[], value: number): number {
  let [low, high] = [0, sorted.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((sorted[middle] ?? 0) < value) low = middle + 1;
    else high = middle;
  }
  return low;
}
