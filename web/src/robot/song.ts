// The song that this page knows, for when the robot asks for one.
// Layer: web/robot, pure. Source: iRobot Create Open Interface, "Song": pairs of note (MIDI number) and length (1/64 s).

const STEPS = [0, 4, 7, 12, 7, 4, 0];
const LENGTH = 16;
const LOWEST = 60; // middle C

/** Rises by a half tone every 100 mm that the robot has gone, up to one octave. */
export function songAfter(distanceMm: number): Uint8Array {
  const halfTones = ((Math.round(distanceMm / 100) % 12) + 12) % 12;
  return Uint8Array.from(STEPS.flatMap((step) => [LOWEST + halfTones + step, LENGTH]));
}

/** "C4 E4 G4". */
export function nameNotes(song: Uint8Array): string {
  const names = ["C", "C♯", "D", "D♯", "E", "F", "F♯", "G", "G♯", "A", "A♯", "B"];
  const notes = [...song].filter((_, index) => index % 2 === 0);
  return notes.map((note) => `${names[note % 12] ?? ""}${Math.floor(note / 12) - 1}`).join(" ");
}
