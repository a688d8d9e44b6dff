// Moves again and again while something is held; its end stops the device at once, whatever the page is doing.
// Layer: web/panels, pure.

const REPEAT_MS = 100;

export interface JogMeans {
  /** Moves for a moment. `isHeld`: whether it is still wanted, after a wait. */
  jog: (isHeld: () => boolean) => Promise<unknown>;
  /** Whether the right to move, which the first moment takes, is still there. */
  mayGoOn: () => boolean;
  stop: () => Promise<unknown>;
  fail: (error: unknown) => void;
  /** What was sent arrived. */
  done: () => void;
  changed: (isHeld: boolean) => void;
}

export class HeldJog {
  readonly #means: JogMeans;
  #run: { timer: ReturnType<typeof setInterval>; hasMoved: boolean } | null = null;
  #isWaiting = false;

  constructor(means: JogMeans) {
    this.#means = means;
  }

  begin(): void {
    if (this.#run) return;
    this.#run = { timer: setInterval(() => this.#send(), REPEAT_MS), hasMoved: false };
    this.#means.changed(true);
    this.#send();
  }

  end(): void {
    if (!this.#run) return;
    clearInterval(this.#run.timer);
    this.#run = null;
    this.#means.changed(false);
    this.#stop(); // at once, and not behind a command that hangs
  }

  #send(): void {
    if (this.#isWaiting) return; // no queue of commands that are old when they are carried out
    const mine = this.#run;
    if (mine?.hasMoved && !this.#means.mayGoOn()) return this.end();
    const isHeld = (): boolean => mine !== null && this.#run === mine;
    this.#isWaiting = true;
    this.#means
      .jog(isHeld)
      .then(
        () => {
          if (!mine || !isHeld()) return;
          mine.hasMoved = true;
          this.#means.done();
        },
        (error: unknown) => (this.#means.fail(error), isHeld() && this.end()),
      )
      .finally(() => {
        this.#isWaiting = false;
        if (!this.#run) this.#stop(); // the stop has gone past it
      });
  }

  #stop(): void {
    this.#means.stop().catch((error: unknown) => this.#means.fail(error));
  }
}
