// The chart of the demo robot: follows a RobotModel.
// Layer: web/chart.

import { useEffect, useRef } from "preact/hooks";
import { useStore } from "../app/store";
import type { RobotModel } from "../robot/robot_model";
import type { Room } from "../robot/room";
import { draw_chart, FRAME_PX } from "./draw_chart";
import { useCanvas } from "./use_canvas";
import { fit, include, START } from "./view";
import type { Extent } from "./view";

export function RobotChart({ model, live }: { model: RobotModel; live: boolean }) {
  const extent = useRef<Extent | null>(null);
  const room = useStore(model.room);
  const readings = useStore(model.readings);
  const { canvas, redraw } = useCanvas((ctx, width, height, palette) => {
    extent.current = include(extent.current ?? extent_of(room), model.pose.x, model.pose.y);
    const view = fit(extent.current, FRAME_PX, FRAME_PX, width - 2 * FRAME_PX, height - 2 * FRAME_PX);
    draw_chart(
      ctx,
      view,
      {
        pose: model.pose,
        strokes: model.trail.strokes,
        room,
        radius_m: model.radius_m,
        bumps: model.bumps.value,
        bumpers: live ? (readings.bumpers ?? 0) : 0,
        live,
      },
      palette,
    );
  });
  useEffect(() => model.on_moved(redraw), [model, redraw]);
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
      aria-label="Map of the floor with the robot, where it has been, and where it bumped. The pose is given in numbers below."
    />
  );
}

function extent_of({ walls }: Room): Extent {
  if (walls.length === 0) return START;
  let extent: Extent = { x_min: Infinity, x_max: -Infinity, y_min: Infinity, y_max: -Infinity };
  for (const { x1, y1, x2, y2 } of walls) {
    extent = {
      x_min: Math.min(extent.x_min, x1, x2),
      x_max: Math.max(extent.x_max, x1, x2),
      y_min: Math.min(extent.y_min, y1, y2),
      y_max: Math.max(extent.y_max, y1, y2),
    };
  }
  const margin = 0.1;
  return {
    x_min: extent.x_min - margin,
    x_max: extent.x_max + margin,
    y_min: extent.y_min - margin,
    y_max: extent.y_max + margin,
  };
}
