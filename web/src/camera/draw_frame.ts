// Draws a camera's frame.
// Layer: web/camera.

import { readPicture } from "./pixels";

/** The pixels that were drawn last: the next picture of the same size is written over them. */
const images = new WeakMap<HTMLCanvasElement, ImageData>();

/** @returns the size in words. @throws Error when the value is no picture. */
export async function drawFrame(canvas: HTMLCanvasElement | null, value: unknown): Promise<string> {
  const frame = readPicture(value);
  const bitmap = frame.encoded ? await createImageBitmap(new Blob([frame.encoded])) : null;
  const width = bitmap?.width ?? frame.width;
  const height = bitmap?.height ?? frame.height;
  const ctx = canvas?.getContext("2d");
  if (canvas && ctx) {
    if (canvas.width !== width) canvas.width = width;
    if (canvas.height !== height) canvas.height = height;
    if (bitmap) ctx.drawImage(bitmap, 0, 0);
    else if (frame.paint) {
      const last = images.get(canvas);
      const image = last?.width === width && last.height === height ? last : new ImageData(width, height);
      images.set(canvas, image);
      frame.paint(new Uint32Array(image.data.buffer));
      ctx.putImageData(image, 0, 0);
    }
  }
  bitmap?.close();
  return `${width} × ${height}`;
}
