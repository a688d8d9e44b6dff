// A canvas that is as sharp as the screen and drawn at most once a frame.
// Layer: web/chart.

import { useCallback, useEffect, useRef } from "preact/hooks";
import type { RefObject } from "preact";
import { onColoursChanged } from "../app/theme";
import { readPalette } from "./palette";
import type { Palette } from "./palette";

export type Paint = (ctx: CanvasRenderingContext2D, width: number, height: number, palette: Palette) => void;

/** @returns the ref for the canvas, and `redraw`, which asks for a new picture. Size and colour changes ask by themselves. */
export function useCanvas(paint: Paint): { canvas: RefObject<HTMLCanvasElement | null>; redraw: () => void } {
  const canvas = useRef<HTMLCanvasElement>(null);
  const latest = useRef(paint);
  latest.current = paint;
  const frame = useRef(0);
  const palette = useRef<Palette | null>(null);

  const redraw = useCallback(() => {
    if (frame.current !== 0) return;
    frame.current = requestAnimationFrame(() => {
      frame.current = 0;
      const element = canvas.current;
      const ctx = element?.getContext("2d");
      if (!element || !ctx) return;
      const { clientWidth: width, clientHeight: height } = element;
      const ratio = Math.min(devicePixelRatio || 1, 3);
      const pixels = [Math.round(width * ratio), Math.round(height * ratio)] as const;
      if (element.width !== pixels[0]) element.width = pixels[0];
      if (element.height !== pixels[1]) element.height = pixels[1];
      if (width === 0 || height === 0) return;
      palette.current ??= readPalette(element);
      ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
      ctx.clearRect(0, 0, width, height);
      latest.current(ctx, width, height, palette.current);
    });
  }, []);

  useEffect(() => {
    const element = canvas.current;
    if (!element) return;
    const resized = new ResizeObserver(redraw);
    resized.observe(element);
    const unwatch = onColoursChanged(() => {
      palette.current = null;
      redraw();
    });
    return () => {
      resized.disconnect();
      unwatch();
      cancelAnimationFrame(frame.current);
      frame.current = 0;
    };
  }, [redraw]);

  return { canvas, redraw };
}
