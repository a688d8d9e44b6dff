// From held keys or buttons to `Drive(velocity, radius)` of the Create.
// Layer: web/robot, pure. Units: mm/s and mm; radius > 0 turns left (counterclockwise), as the Create's open interface says.

export type Direction = "forward" | "back" | "left" | "right";

export interface DriveCommand {
  velocity: number;
  radius: number;
}

export const STRAIGHT = 32767;
export const SPIN_LEFT = 1;
export const SPIN_RIGHT = -1;
export const TURN_RADIUS = 350;
export const STOP: DriveCommand = { velocity: 0, radius: STRAIGHT };

export const SPEED_MIN = 50;
export const SPEED_MAX = 500;

/** Opposite directions cancel; left or right alone spins on the spot, at half speed so that it can be aimed. */
export function commandFor(held: ReadonlySet<Direction>, speed: number): DriveCommand {
  const ahead = Number(held.has("forward")) - Number(held.has("back"));
  const left = Number(held.has("left")) - Number(held.has("right"));
  if (ahead === 0 && left === 0) return STOP;
  if (ahead === 0) return { velocity: Math.round(speed / 2), radius: left > 0 ? SPIN_LEFT : SPIN_RIGHT };
  return { velocity: ahead * speed, radius: left === 0 ? STRAIGHT : left * TURN_RADIUS };
}

export function sameCommand(a: DriveCommand, b: DriveCommand): boolean {
  return a.velocity === b.velocity && a.radius === b.radius;
}

const KEYS: Readonly<Record<string, Direction>> = {
  ArrowUp: "forward",
  ArrowDown: "back",
  ArrowLeft: "left",
  ArrowRight: "right",
  KeyW: "forward",
  KeyS: "back",
  KeyA: "left",
  KeyD: "right",
};

/** By `KeyboardEvent.code`, so WASD stays where it is on every keyboard layout. */
export function directionOfKey(code: string): Direction | undefined {
  return KEYS[code];
}
