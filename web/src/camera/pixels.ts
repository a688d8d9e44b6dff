// The pixels of any struct that is shaped like an image: sizes, an encoding, and bytes.
// Layer: web/camera, pure. Source: com.robotraconteur.image (ImageEncoding); experimental.createwebcam2 for those that say none.

import type { Frame, Paint } from "./frame";
import { colours, OPAQUE, readFrame } from "./frame";

const MAX_PIXELS = 4096 * 4096;

interface Layout {
  /** Bytes of a pixel. */
  bytes: number;
  /** Where red, green and blue are; or how one number is read. */
  channels?: readonly [number, number, number];
  number?: "u8" | "u16" | "i16" | "u32" | "i32" | "f32" | "f64";
}

/** By number and by name: text encodings are those of the field. */
const LAYOUTS: readonly (readonly [number, readonly string[], Layout])[] = [
  [0x1000, ["rgb888", "rgb8"], { bytes: 3, channels: [0, 1, 2] }],
  [0x1001, ["rgba8888", "rgba8"], { bytes: 4, channels: [0, 1, 2] }],
  [0x1002, ["bgr888", "bgr8"], { bytes: 3, channels: [2, 1, 0] }],
  [0x1003, ["bgra8888", "bgra8"], { bytes: 4, channels: [2, 1, 0] }],
  [0x2000, ["mono8"], { bytes: 1, number: "u8" }],
  [0x2001, ["mono16"], { bytes: 2, number: "u16" }],
  [0x2002, ["mono32"], { bytes: 4, number: "u32" }],
  [0x2004, ["mono_f32"], { bytes: 4, number: "f32" }],
  [0x2005, ["mono_f64"], { bytes: 8, number: "f64" }],
  [0x4000, ["depth_u16"], { bytes: 2, number: "u16" }],
  [0x4001, ["depth_i16"], { bytes: 2, number: "i16" }],
  [0x4002, ["depth_u32"], { bytes: 4, number: "u32" }],
  [0x4003, ["depth_i32"], { bytes: 4, number: "i32" }],
  [0x4006, ["depth_f32"], { bytes: 4, number: "f32" }],
  [0x4007, ["depth_f64"], { bytes: 8, number: "f64" }],
];

/** @throws Error when the value is no picture, with what was found and what was expected. */
export function readPicture(value: unknown): Frame {
  const given = (value ?? {}) as Record<string, unknown>;
  const info = (given["image_info"] ?? given) as Record<string, unknown>;
  const { data } = given;
  const layout = layoutOf(info["encoding"] ?? info["format"]);
  if (!(data instanceof Uint8Array) || !layout || isFile(data)) return readFrame({ ...info, data });
  const [width, height] = [Number(info["width"]), Number(info["height"])];
  if (!(width >= 1 && height >= 1 && width * height <= MAX_PIXELS))
    throw new Error(`the picture is ${width} by ${height} pixels; expected at least 1 by 1`);
  const step = Number(info["step"]) || width * layout.bytes;
  const needed = step * (height - 1) + width * layout.bytes;
  if (step < width * layout.bytes || data.length < needed || data.length > step * height)
    throw new Error(
      `the picture has ${data.length} bytes in rows of ${step}; expected ${needed} for ${width} by ${height}`,
    );
  const paint = layout.channels
    ? colours(data, width, height, step, layout.bytes, layout.channels)
    : greys(data, width, height, step, layout);
  return { width, height, paint, encoded: null };
}

function layoutOf(encoding: unknown): Layout | undefined {
  return LAYOUTS.find(([number, names]) => number === encoding || names.includes(String(encoding)))?.[2];
}

function isFile(data: Uint8Array): boolean {
  return (data[0] === 0xff && data[1] === 0xd8) || (data[0] === 0x89 && data[1] === 0x50);
}

/** Bytes as they are; wider numbers from the least (black) to the greatest (white), since no range is known. */
function greys(data: Uint8Array, width: number, height: number, step: number, { bytes, number = "u8" }: Layout): Paint {
  if (number === "u8") return colours(data, width, height, step, 1, [0, 0, 0]);
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  const read = {
    u16: (at: number) => view.getUint16(at, true),
    i16: (at: number) => view.getInt16(at, true),
    u32: (at: number) => view.getUint32(at, true),
    i32: (at: number) => view.getInt32(at, true),
    f32: (at: number) => view.getFloat32(at, true),
    f64: (at: number) => view.getFloat64(at, true),
  }[number];
  return (to) => {
    let [low, high] = [Infinity, -Infinity];
    for (let y = 0; y < height; y++) {
      for (let x = 0; x < width; x++) {
        const value = read(y * step + x * bytes);
        if (value < low) low = value;
        if (value > high) high = value;
      }
    }
    const scale = high > low ? 255 / (high - low) : 0;
    for (let y = 0, at = 0; y < height; y++) {
      for (let x = 0; x < width; x++) {
        const grey = Math.round((read(y * step + x * bytes) - low) * scale) & 255; // NaN is black
        to[at++] = OPAQUE | (grey * 0x10101);
      }
    }
  };
}
