// Dead reckoning: the pose of a differential-drive robot from how far it drove and how far it turned.
// Layer: web/robot, pure. Units: metres and radians out; x to the east, y to the north, theta counterclockwise from x.

export interface Pose {
  x: number;
  y: number;
  theta: number;
}

export const ORIGIN: Pose = { x: 0, y: 0, theta: 0 };

/** The pose after driving `distanceM` along an arc that turns by `turnRad`. */
export function advance(pose: Pose, distanceM: number, turnRad: number): Pose {
  // The chord of the arc points along the middle heading; its length is 2 r sin(turn / 2) with r = distance / turn.
  const half = turnRad / 2;
  const chord = Math.abs(half) < 1e-6 ? distanceM : (distanceM * Math.sin(half)) / half;
  return {
    x: pose.x + chord * Math.cos(pose.theta + half),
    y: pose.y + chord * Math.sin(pose.theta + half),
    theta: wrapAngle(pose.theta + turnRad),
  };
}

/** The same angle in (-pi, pi]. */
export function wrapAngle(angle: number): number {
  const turn = 2 * Math.PI;
  const wrapped = ((angle % turn) + turn) % turn;
  return wrapped > Math.PI ? wrapped - turn : wrapped;
}

/** Follows two counters that only ever grow from an unknown start: total distance in mm, total turn in degrees. */
export class Reckoner {
  #pose: Pose;
  #last: { distanceMm: number; angleDeg: number } | null = null;

  constructor(start: Pose = ORIGIN) {
    this.#pose = start;
  }

  get pose(): Pose {
    return this.#pose;
  }

  /** Takes the counters' next values. The first ones after construction or `rebase` only set the baseline. */
  update(distanceMm: number, angleDeg: number): Pose {
    if (this.#last) {
      this.#pose = advance(
        this.#pose,
        (distanceMm - this.#last.distanceMm) / 1000,
        ((angleDeg - this.#last.angleDeg) * Math.PI) / 180,
      );
    }
    this.#last = { distanceMm, angleDeg };
    return this.#pose;
  }

  /** Forgets the baseline: a device that restarted counts from zero again, and its pose must not jump. */
  rebase(): void {
    this.#last = null;
  }
}
