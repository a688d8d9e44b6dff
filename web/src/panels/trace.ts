// The last minutes of a few numbers at the same times, for a plot and a file.
// Layer: web/panels, pure.

const MOST = 20_000;

export class Trace {
  #times: number[] = [];
  readonly #columns: (number | null)[][];

  constructor(columns: number) {
    this.#columns = Array.from({ length: columns }, () => []);
  }

  #pushed = 0;

  /** `now`: milliseconds of a clock that only grows. What is no finite number is null. */
  push(now: number, values: readonly (number | undefined)[]): void {
    this.#pushed++;
    this.#times.push(now);
    this.#columns.forEach((column, i) => column.push(finite(values[i])));
    if (this.#times.length < MOST * 1.25) return;
    const over = this.#times.length - MOST;
    this.#times.splice(0, over);
    for (const column of this.#columns) column.splice(0, over);
  }

  /** What comes next was not measured right after what came last: a row of nulls at its time. */
  breakOff(): void {
    const end = this.#times.at(-1);
    if (end !== undefined) this.push(end, []);
  }

  /** How often something was pushed: the same number, the same window. */
  get pushed(): number {
    return this.#pushed;
  }

  /** The newest `seconds`: times in seconds before the last (0), then the values. */
  window(seconds: number): (number | null)[][] {
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
export function lonely(column: ArrayLike<number | null | undefined>): number[] | null {
  const found: number[] = [];
  const isThere = (i: number): boolean => column[i] !== null && column[i] !== undefined;
  for (let i = 0; i < column.length; i++) if (isThere(i) && !isThere(i - 1) && !isThere(i + 1)) found.push(i);
  return found.length > 0 ? found : null;
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
