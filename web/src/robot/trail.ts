// Where the robot has been: strokes of points, thinned so that hours of driving stay drawable.
// Layer: web/robot, pure. Units: metres.

export interface Point {
  x: number;
  y: number;
}

const SPACING_M = 0.01;
const JUMP_M = 0.4; // further than any robot here drives between two readings: it was put elsewhere, or restarted
const MAX_POINTS = 12_000;

export class Trail {
  /** Unbroken lines, oldest first. */
  readonly strokes: Point[][] = [];
  #count = 0;

  /** Adds where the robot is now; a jump begins a new stroke. */
  add(point: Point): void {
    const stroke = this.strokes[this.strokes.length - 1];
    const last = stroke?.[stroke.length - 1];
    if (!stroke || !last) {
      this.#begin(point);
      return;
    }
    const moved = Math.hypot(point.x - last.x, point.y - last.y);
    if (moved < SPACING_M) return;
    if (moved > JUMP_M) {
      this.#begin(point);
      return;
    }
    stroke.push(point);
    this.#count++;
    if (this.#count > MAX_POINTS) this.#forgetOldest();
  }

  clear(): void {
    this.strokes.length = 0;
    this.#count = 0;
  }

  get count(): number {
    return this.#count;
  }

  #begin(point: Point): void {
    this.strokes.push([point]);
    this.#count++;
  }

  #forgetOldest(): void {
    const oldest = this.strokes[0];
    if (!oldest) return;
    const dropped = Math.min(oldest.length, MAX_POINTS / 10);
    oldest.splice(0, dropped);
    this.#count -= dropped;
    if (oldest.length === 0) this.strokes.shift();
  }
}
