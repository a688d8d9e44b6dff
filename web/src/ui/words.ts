// Times of day, spans and sentences, as people read them.
// Layer: web/ui, pure.

import { t } from "../app/language";

/** `14:03:22` in the reader's own time. */
export function clockTime(ms: number): string {
  return new Date(ms).toLocaleTimeString(undefined, {
    hour: "2-digit",
    minute: "2-digit",
    second: "2-digit",
    hour12: false,
  });
}

/** `14:03:22.417`: for logs, where order matters. */
export function clockTimeMs(ms: number): string {
  return `${clockTime(ms)}.${String(Math.floor(ms) % 1000).padStart(3, "0")}`;
}

/** `4 s`, `3 min`, `2 h 5 min`. */
export function span(ms: number): string {
  const seconds = Math.max(0, Math.floor(ms / 1000));
  if (seconds < 60) return `${seconds} s`;
  const minutes = Math.floor(seconds / 60);
  if (minutes < 60) return `${minutes} min`;
  return `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
}

const STALE_MS = 800; // a value says that it is old within a second, wherever it is looked at ten times a second

/** `3 s old` for a value that ought to be newer; null for one that is young. */
export function staleAge(ageMs: number): string | null {
  return ageMs < STALE_MS ? null : t("{0} old", span(ageMs + 500));
}

/** A text whose lines were broken for an editor, in paragraphs: lists and empty lines stay as they are. */
export function flowing(text: string): string {
  return text.trim().replace(/(\S)[ \t]*\n(?!\s|[-*•]|\d+[.)])/g, "$1 ");
}

/** The same text with an end, and a capital where it begins with a plain word; names and addresses stay as they are. */
export function sentence(text: string): string {
  return ended(text).replace(
    /^[a-z]+(?:'[a-z]+)?(?=,? |[.!?]$)/,
    (word) => word.charAt(0).toUpperCase() + word.slice(1),
  );
}

/** The same text with an end: the rest of a sentence. */
export function ended(text: string): string {
  const trimmed = text.trim();
  return /[.!?]$/.test(trimmed) ? trimmed : `${trimmed}.`;
}

/** `0 B`, `12 kB`, `3.4 MB`. */
export function bytesText(bytes: number): string {
  const units = ["B", "kB", "MB", "GB", "TB"];
  let [value, unit] = [bytes, 0];
  for (; value >= 1000 && unit < units.length - 1; unit++) value /= 1000;
  return `${unit === 0 || value >= 100 ? Math.round(value) : value.toFixed(1)} ${units[unit]}`;
}

/** `0.4 ms`, `12 ms`, `1.5 s`: how old a value is. */
export function ageText(ms: number): string {
  if (ms >= 1000) return `${(ms / 1000).toFixed(1)} s`;
  return ms < 10 ? `${ms.toFixed(1)} ms` : `${Math.round(ms)} ms`;
}

/** `0:04.2`, `12:30.0`, `1:02:30.0`: a time of a recording. */
export function timeText(seconds: number): string {
  const tenths = Math.round(Math.max(0, seconds) * 10);
  const two = (number: number): string => String(number).padStart(2, "0");
  const [minutes, rest] = [Math.floor(tenths / 600), tenths % 600];
  const end = `${two(Math.floor(rest / 10))}.${rest % 10}`;
  return minutes < 60 ? `${minutes}:${end}` : `${Math.floor(minutes / 60)}:${two(minutes % 60)}:${end}`;
}
