// The part of the floor that a chart shows.
import { fit, gridStep, include, START, toCanvas } from "../../web/src/chart/view";

describe("view of the chart", () => {
  it("fits the wanted floor, centred, north up", () => {
    const view = fit({ xMin: -2, xMax: 2, yMin: -1, yMax: 1 }, 10, 20, 400, 400);
    expect(view.scale).toBe(100);
    expect(toCanvas(view, 0, 0)).toEqual([210, 220]);
    expect(toCanvas(view, 2, 2)).toEqual([410, 20]);
  });
  it("grows in half metres to hold the robot, and stays while it is inside", () => {
    expect(include(START, 1, 1)).toBe(START);
    expect(include(START, 2.2, 0)).toEqual({ ...START, xMax: 3 });
    expect(include(START, NaN, 0)).toBe(START);
  });
  it("labels the grid at readable distances", () => {
    expect(gridStep(120)).toBe(0.5);
    expect(gridStep(60)).toBe(1);
    expect(gridStep(10)).toBe(10);
    expect(gridStep(0.001)).toBeGreaterThan(1000);
  });
});
