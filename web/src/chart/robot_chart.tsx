// The chart of the demo robot: follows a RobotModel.
// Layer: web/chart.

import { useEffect, useRef } from "preact/hooks";
import { t } from "../app/language";
import { useStore } from "../app/store";
import type { RobotModel } from "../robot/robot_model";
import type { Room } from "../robot/room";
import { drawChart, FRAME_PX } from "./draw_chart";
import { useCanvas } from "./use_canvas";
import { fit, include, START } from "./view";
import type { Extent } from "./view";

export function RobotChart({ model, live }: { model: RobotModel; live: boolean }) {
  const extent = useRef<Extent | null>(null);
  const room = useStore(model.room);
  const readings = useStore(model.readings);
  const { canvas, redraw } = useCanvas((ctx, width, height, palette) => {
    extent.current = include(extent.current ?? extentOf(room), model.pose.x, model.pose.y);
    const view = fit(extent.current, FRAME_PX, FRAME_PX, width - 2 * FRAME_PX, height - 2 * FRAME_PX);
    drawChart(
      ctx,
      view,
      {
        pose: model.pose,
        strokes: model.trail.strokes,
        room,
        radiusM: model.radiusM,
        bumps: model.bumps.value,
        bumpers: live ? (readings.bumpers ?? 0) : 0,
        live,
      },
      palette,
    );
  });
  useEffect(() => model.onMoved(redraw), [model, redraw]);
  useEffect(() => {
    extent.current = null;
    redraw();
  }, [room, redraw]);
  useEffect(redraw, [live, readings.bumpers, redraw]);
  return (
    <canvas
      ref={canvas}
      class="chart"
      role="img"
      aria-label={t(
        "Map of the floor with the robot, where it has been, and where it bumped. The pose is given in numbers below.",
      )}
    />
  );
}

function extentOf({ walls }: Room): Extent {
  if (walls.length === 0) return START;
  let extent: Extent = { xMin: Infinity, xMax: -Infinity, yMin: Infinity, yMax: -Infinity };
  for (const { x1, y1, x2, y2 } of walls) {
    extent = {
      xMin: Math.min(extent.xMin, x1, x2),
      xMax: Math.max(extent.xMax, x1, x2),
      yMin: Math.min(extent.yMin, y1, y2),
      yMax: Math.max(extent.yMax, y1, y2),
    };
  }
  const margin = 0.1;
  return {
    xMin: extent.xMin - margin,
    xMax: extent.xMax + margin,
    yMin: extent.yMin - margin,
    yMax: extent.yMax + margin,
  };
}
