// Turns a camera's frame into pixels of a canvas, without a copy of its own.
// Layer: web/camera, pure. Source: experimental.createwebcam2: blue, green, red; rows from top to bottom, `step` bytes apart.

/** Writes all pixels: one number each, whose bytes are red, green, blue, opaque (in the order of all machines that run browsers). */
export type Paint = (to: Uint32Array) => void;

export interface Frame {
  width: number;
  height: number;
  /** Null where `encoded` is set. */
  paint: Paint | null;
  /** A whole JPEG or PNG file, where the camera sends that instead of pixels. */
  encoded: Uint8Array<ArrayBuffer> | null;
}

const MAX_PIXELS = 4096 * 4096;

/** @throws Error when the struct is no picture, with what was found and what was expected. */
export function readFrame(value: unknown): Frame {
  const { width, height, step, data } = (value ?? {}) as Record<string, unknown>;
  if (!(data instanceof Uint8Array)) throw new Error("the camera's frame has no bytes in field 'data'");
  if (isImageFile(data)) return { width: 0, height: 0, paint: null, encoded: data as Uint8Array<ArrayBuffer> };
  if (
    typeof width !== "number" ||
    typeof height !== "number" ||
    width < 1 ||
    height < 1 ||
    width * height > MAX_PIXELS
  ) {
    throw new Error(`the camera's frame is ${String(width)} by ${String(height)} pixels; expected at least 1 by 1`);
  }
  const row = typeof step === "number" && step > 0 ? step : width * Math.floor(data.length / width / height);
  const channels = row >= width * 3 ? 3 : 1;
  if (row < width * channels || data.length < row * (height - 1) + width * channels || data.length > row * height) {
    throw new Error(
      `the camera's frame has ${data.length} bytes in rows of ${row}; expected ${width * height * 3} for ${width} by ${height} pixels`,
    );
  }
  const [red, green] = channels === 3 ? [2, 1] : [0, 0];
  return { width, height, paint: colours(data, width, height, row, channels, [red, green, 0]), encoded: null };
}

export const OPAQUE = 0xff000000 | 0;

/** Rows `step` bytes apart, of pixels of `bytes`; where in a pixel red, green and blue are. Sizes were checked. */
export function colours(
  data: Uint8Array,
  width: number,
  height: number,
  step: number,
  bytes: number,
  [red, green, blue]: readonly [number, number, number],
): Paint {
  return (to) => fill(to, data, width, height, step, bytes, red, green, blue);
}

/** Of its own arguments only: what a closure holds is read anew for each pixel. */
function fill(
  to: Uint32Array,
  data: Uint8Array,
  width: number,
  height: number,
  step: number,
  bytes: number,
  red: number,
  green: number,
  blue: number,
): void {
  let at = 0;
  for (let y = 0; y < height; y++) {
    let from = y * step;
    for (let x = 0; x < width; x++) {
      to[at++] =
        OPAQUE |
        ((data[from + blue] as number) << 16) |
        ((data[from + green] as number) << 8) |
        (data[from + red] as number);
      from += bytes;
    }
  }
}

function isImageFile(data: Uint8Array): boolean {
  const jpeg = data[0] === 0xff && data[1] === 0xd8 && data[2] === 0xff;
  const png = data[0] === 0x89 && data[1] === 0x50 && data[2] === 0x4e && data[3] === 0x47;
  return jpeg || png;
}
