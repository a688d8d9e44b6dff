// Numbers as lines of hexadecimal digits, and as a picture.
// Layer: web/panels, pure.

const MOST_BYTES = 4096;
const MOST_PIXELS = 4096 * 4096;

/** Sixteen bytes a line, with their offset in items; null for what has no bytes. */
export function hexLines(value: unknown, fromItem: number): string | null {
  const view = numbersOf(value);
  if (!view) return null;
  const bytes = new Uint8Array(view.buffer, view.byteOffset, Math.min(view.byteLength, MOST_BYTES));
  const itemBytes = view.byteLength / Math.max(1, (view as unknown as ArrayLike<unknown>).length);
  const lines: string[] = [];
  for (let at = 0; at < bytes.length; at += 16) {
    const line = bytes.subarray(at, at + 16);
    const digits = Array.from(line, (byte) => byte.toString(16).padStart(2, "0")).join(" ");
    const text = Array.from(line, (byte) => (byte >= 32 && byte < 127 ? String.fromCharCode(byte) : ".")).join("");
    lines.push(`${String(fromItem + Math.floor(at / itemBytes)).padStart(8)}  ${digits.padEnd(47)}  ${text}`);
  }
  if (view.byteLength > bytes.length) lines.push(`… ${view.byteLength - bytes.length} bytes more`);
  return lines.join("\n");
}

/** Grey values from the least number (black) to the greatest (white); of two dimensions the first is down. */
export function greyPicture(
  value: unknown,
): { width: number; height: number; rgba: Uint8ClampedArray<ArrayBuffer> } | null {
  const numbers = numbersOf(value) as unknown as ArrayLike<number> | null;
  if (!numbers || numbers.length === 0 || numbers.length > MOST_PIXELS || typeof numbers[0] === "bigint") return null;
  const dims = (value as { dims?: unknown }).dims;
  const [rows, columns] =
    Array.isArray(dims) && dims.length === 2
      ? (dims as [number, number])
      : [Math.ceil(numbers.length / Math.ceil(Math.sqrt(numbers.length))), Math.ceil(Math.sqrt(numbers.length))];
  const isMatrix = Array.isArray(dims) && dims.length === 2;
  let [low, high] = [Infinity, -Infinity];
  for (let i = 0; i < numbers.length; i++) {
    low = Math.min(low, numbers[i] ?? 0);
    high = Math.max(high, numbers[i] ?? 0);
  }
  const scale = high > low ? 255 / (high - low) : 0;
  const rgba = new Uint8ClampedArray(rows * columns * 4);
  for (let y = 0; y < rows; y++) {
    for (let x = 0; x < columns; x++) {
      const grey = ((numbers[isMatrix ? x * rows + y : y * columns + x] ?? low) - low) * scale; // the first index runs fastest
      rgba.set([grey, grey, grey, 255], (y * columns + x) * 4);
    }
  }
  return { width: columns, height: rows, rgba };
}

function numbersOf(value: unknown): ArrayBufferView | null {
  if (ArrayBuffer.isView(value)) return value;
  const data = (value as { data?: unknown } | null)?.data;
  return ArrayBuffer.isView(data) ? data : null;
}
