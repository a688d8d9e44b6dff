// How long to wait before the next attempt to connect.
// Layer: web/robot, pure.

const FIRST_MS = 500;
const LONGEST_MS = 10_000;
const JITTER = 0.5; // each wait is 1 to 1.5 times its step, so pages that lost the same device do not return in step

/** Wait before attempt `attempt` (0 is the first): 500 ms doubling to 10 s, jitter included. */
export function backoffMs(attempt: number, random: () => number = Math.random): number {
  const longestStep = LONGEST_MS / (1 + JITTER);
  const step = Math.min(FIRST_MS * 2 ** Math.min(attempt, 16), longestStep);
  return Math.round(step * (1 + JITTER * random()));
}
