// Draws a camera's frame.
// Layer: web/camera.

import { readPicture } from "./pixels";

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
    else if (frame.rgba) ctx.putImageData(new ImageData(frame.rgba, width, height), 0, 0);
  }
  bitmap?.close();
  return `${width} × ${height}`;
}
