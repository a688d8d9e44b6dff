// Turns at drawing: in each frame one of those that want to, so that many plots hold up neither keys nor frames.
// Layer: web/chart.

type Draw = () => void;

const waiting = new Set<Draw>();
let frame = 0;

/** Calls `draw` once in a frame to come, behind those that wait already. */
export function drawInTurn(draw: Draw): void {
  waiting.add(draw);
  frame ||= requestAnimationFrame(drawNext);
}

/** Does not call it any more. */
export function leaveTurn(draw: Draw): void {
  waiting.delete(draw);
}

function drawNext(): void {
  frame = 0;
  const [next] = waiting;
  if (!next) return;
  waiting.delete(next);
  if (waiting.size > 0) frame = requestAnimationFrame(drawNext);
  next();
}
