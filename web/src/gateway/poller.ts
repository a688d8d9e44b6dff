// Asks the gateway again and again while somebody looks. Layer: web/gateway.

const DEADLINE_MS = 5_000;

/** What is done with one look: its answer, or why there is none. */
export interface PollerOptions<T> {
  ask: (signal: AbortSignal) => Promise<T>;
  answered: (answer: T) => void;
  failed: (error: unknown) => void;
  /** Milliseconds from one look to the next. */
  period: number;
  /** The same in a hidden tab; null: not until it is shown. */
  hiddenPeriod: number | null;
}

export class Poller<T> {
  readonly #options: PollerOptions<T>;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #abort: AbortController | null = null;

  constructor(options: PollerOptions<T>) {
    this.#options = options;
  }

  start(): void {
    document.addEventListener("visibilitychange", this.#onVisibility);
    void this.#poll();
  }

  stop(): void {
    document.removeEventListener("visibilitychange", this.#onVisibility);
    clearTimeout(this.#timer);
    this.#abort?.abort();
    this.#abort = null;
  }

  /** Asks now. */
  refresh(): void {
    if (this.#abort) return;
    clearTimeout(this.#timer);
    void this.#poll();
  }

  readonly #onVisibility = (): void => {
    if (!document.hidden) this.refresh();
    else if (this.#options.hiddenPeriod === null) clearTimeout(this.#timer);
  };

  async #poll(): Promise<void> {
    const { ask, answered, failed, period, hiddenPeriod } = this.#options;
    const abort = new AbortController();
    this.#abort = abort;
    const deadline = setTimeout(() => abort.abort(new Error("the gateway did not answer within 5 s")), DEADLINE_MS);
    let tell: () => void;
    try {
      const answer = await ask(abort.signal);
      tell = () => answered(answer);
    } catch (error) {
      tell = () => failed(error);
    } finally {
      clearTimeout(deadline);
    }
    if (this.#abort !== abort) return; // stopped meanwhile
    this.#abort = null;
    tell();
    const next = document.hidden ? hiddenPeriod : period;
    if (next !== null) this.#timer = setTimeout(() => void this.#poll(), next);
  }
}

/** Why it does not answer, for people. */
export function reasonOf(error: unknown): string {
  if ((error as Error).name === "TimeoutError") return "the gateway did not answer in time";
  return error instanceof TypeError ? "the gateway cannot be reached" : (error as Error).message;
}
