// Pictures of cameras by their encoding, memories as bytes and as grey values.
import { hexLines, greyPicture } from "../../web/src/panels/bytes";
import { readFrame } from "../../web/src/camera/frame";
import type { Frame } from "../../web/src/camera/frame";
import { readPicture } from "../../web/src/camera/pixels";

test("memories are shown as bytes and as grey values", () => {
  expect(hexLines(Uint8Array.from([0x41, 0, 255]), 16)).toMatch(/^ {6}16 {2}41 00 ff +A\.\.$/);
  expect(hexLines("x", 0)).toBeNull();
  const picture = greyPicture({ dims: [1, 2], data: Float64Array.of(-1, 1) });
  expect(picture && [picture.width, picture.height, ...picture.rgba]).toEqual([2, 1, 0, 0, 0, 255, 255, 255, 255, 255]);
});

test("pictures of the standard types are read by their encoding", () => {
  const info = { width: 1, height: 1, step: 3, encoding: 0x1000 };
  expect(rgbaOf(readPicture({ image_info: info, data: Uint8Array.of(1, 2, 3) }))).toEqual([1, 2, 3, 255]);
  const bgr = readPicture({ image_info: { ...info, encoding: 0x1002 }, data: Uint8Array.of(1, 2, 3) });
  expect(rgbaOf(bgr)).toEqual([3, 2, 1, 255]);
  const depth = { image_info: { width: 2, height: 1, step: 4, encoding: 0x4000 }, data: Uint8Array.of(0, 0, 16, 39) };
  expect(rgbaOf(readPicture(depth))).toEqual([0, 0, 0, 255, 255, 255, 255, 255]);
  const jpeg = Uint8Array.of(255, 216, 255);
  expect(readPicture({ image_info: info, data: jpeg }).encoded).toBe(jpeg); // not copied
  const surplus = { image_info: { width: 2, height: 2, encoding: "rgb8" }, data: new Uint8Array(16) }; // with alpha
  expect(() => readPicture(surplus)).toThrow("16 bytes");
  const grey = { image_info: { width: 2, height: 1, step: 2, encoding: "mono8" }, data: Uint8Array.of(7, 255) };
  expect(rgbaOf(readPicture(grey))).toEqual([7, 7, 7, 255, 255, 255, 255, 255]);
  expect(() => readPicture({ image_info: { ...info, width: 9 }, data: Uint8Array.of(1, 2, 3) })).toThrow(
    "the picture has 3 bytes",
  );
});

describe("camera frames", () => {
  it("turns blue, green, red rows with padding into pixels", () => {
    const data = Uint8Array.of(1, 2, 3, 4, 5, 6, 0, 0, 7, 8, 9, 10, 11, 12);
    const frame = readFrame({ width: 2, height: 2, step: 8, data });
    expect(rgbaOf(frame)).toEqual([3, 2, 1, 255, 6, 5, 4, 255, 9, 8, 7, 255, 12, 11, 10, 255]);
  });
  it("shows one byte a pixel as grey", () => {
    expect(rgbaOf(readFrame({ width: 1, height: 1, step: 1, data: Uint8Array.of(9) }))).toEqual([9, 9, 9, 255]);
  });
  it("leaves image files to the browser", () => {
    const frame = readFrame({ width: 0, height: 0, step: 0, data: Uint8Array.of(0xff, 0xd8, 0xff, 0xe0) });
    expect(frame.encoded).toHaveLength(4);
  });
  it("refuses frames whose size and bytes contradict each other", () => {
    expect(() => readFrame({ width: 2, height: 2, step: 6, data: new Uint8Array(11) })).toThrow(
      "has 11 bytes in rows of 6; expected 12",
    );
    expect(() => readFrame({ width: 2, height: 2, step: 6, data: new Uint8Array(13) })).toThrow("13 bytes");
    expect(() => readFrame({ width: 20, height: 10, data: new Uint8Array(300) })).toThrow("300 bytes");
    expect(() => readFrame({ width: -1, height: 2, step: 6, data: new Uint8Array(12) })).toThrow("-1 by 2 pixels");
    expect(() => readFrame({ width: 1e9, height: 1e9, step: 6, data: new Uint8Array(12) })).toThrow("pixels");
    expect(() => readFrame(null)).toThrow("no bytes");
  });
});

function rgbaOf({ width, height, paint }: Frame): number[] {
  const pixels = new Uint32Array(width * height);
  paint?.(pixels);
  return [...new Uint8Array(pixels.buffer)];
}
