// Turns a camera's frame into pixels of a canvas.
// Layer: web/camera, pure. Source: experimental.createwebcam2: blue, green, red; rows from top to bottom, `step` bytes apart.

export interface Frame {
  width: number;
  height: number;
  /** Four bytes a pixel: red, green, blue, opaque. Null where `encoded` is set. */
  rgba: Uint8ClampedArray<ArrayBuffer> | null;
  /** A whole JPEG or PNG file, where the camera sends that instead of pixels. */
  encoded: Uint8Array<ArrayBuffer> | null;
}

const MAX_PIXELS = 4096 * 4096;

/** @throws Error when the struct is no picture, with what was found and what was expected. */
export function readFrame(value: unknown): Frame {
  const { width, height, step, data } = (value ?? {}) as Record<string, unknown>;
  if (!(data instanceof Uint8Array)) throw new Error("the camera's frame has no bytes in field 'data'");
  if (isImageFile(data)) return { width: 0, height: 0, rgba: null, encoded: new Uint8Array(data) };
  if (
    typeof width !== "number" ||
    typeof height !== "number" ||
    width < 1 ||
    height < 1 ||
    width * height > MAX_PIXELS
  ) {
    throw new Error(`the camera's frame is ${String(width)} by ${String(height)} pixels; expected at least 1 by 1`);
  }
  const row = typeof step === "number" && step > 0 ? step : data.length / height;
  const channels = row >= width * 3 ? 3 : 1;
  if (row < width * channels || data.length < row * (height - 1) + width * channels) {
    throw new Error(
      `the camera's frame has ${data.length} bytes in rows of ${row}; expected ${width * height * 3} for ${width} by ${height} pixels`,
    );
  }
  return { width, height, rgba: toRgba(data, width, height, row, channels), encoded: null };
}

function toRgba(
  data: Uint8Array,
  width: number,
  height: number,
  row: number,
  channels: 1 | 3,
): Uint8ClampedArray<ArrayBuffer> {
  const rgba = new Uint8ClampedArray(width * height * 4);
  const [red, green] = channels === 3 ? [2, 1] : [0, 0];
  let to = 0;
  for (let y = 0; y < height; y++) {
    let from = y * row;
    for (let x = 0; x < width; x++) {
      rgba[to] = data[from + red] ?? 0;
      rgba[to + 1] = data[from + green] ?? 0;
      rgba[to + 2] = data[from] ?? 0;
      rgba[to + 3] = 255;
      to += 4;
      from += channels;
    }
  }
  return rgba;
}

function isImageFile(data: Uint8Array): boolean {
  const jpeg = data[0] === 0xff && data[1] === 0xd8 && data[2] === 0xff;
  const png = data[0] === 0x89 && data[1] === 0x50 && data[2] === 0x4e && data[3] === 0x47;
  return jpeg || png;
}
