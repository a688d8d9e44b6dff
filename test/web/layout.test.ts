// Where the panels of a board stand.
import { findRoom, nudge, put, settle, spread } from "../../web/src/board/layout";
import type { Placed } from "../../web/src/board/layout";

describe("the layout", () => {
  const panels: Placed[] = [
    { id: "a", x: 0, y: 0, w: 6, h: 4 },
    { id: "b", x: 6, y: 0, w: 6, h: 4 },
    { id: "c", x: 0, y: 4, w: 12, h: 3 },
  ];
  const overlaps = (all: readonly Placed[]): number =>
    all.flatMap((a) =>
      all.filter((b) => a.id < b.id && a.x < b.x + b.w && b.x < a.x + a.w && a.y < b.y + b.h && b.y < a.y + a.h),
    ).length;

  test("makes room for what is moved, and nothing overlaps or floats", () => {
    const moved = put(panels, "c", { y: 0 });
    expect(overlaps(moved)).toBe(0);
    expect(moved.find(({ id }) => id === "c")?.y).toBe(0);
    expect(moved.find(({ id }) => id === "a")?.y).toBe(3);
    expect(put(panels, "a", { w: 99, h: 0, x: -5 }).find(({ id }) => id === "a")).toMatchObject({ x: 0, w: 12, h: 3 });
    expect(settle([{ id: "x", x: 3, y: 50, w: 2, h: 3 }])[0]?.y).toBe(0);
  });

  test("changes places with what is below, step by step", () => {
    let now = panels;
    for (let i = 0; i < 8; i++) now = nudge(now, "c", 0, -1);
    expect(now.find(({ id }) => id === "c")?.y).toBe(0);
    for (let i = 0; i < 12; i++) now = nudge(now, "c", 0, 1);
    expect(now.find(({ id }) => id === "c")?.y).toBe(4);
    expect(overlaps(now)).toBe(0);
  });

  test("finds the first free place", () => {
    expect(findRoom(panels, { w: 4, h: 4 })).toEqual({ x: 0, y: 7, w: 4, h: 4 });
    expect(findRoom([], { w: 40, h: 4 })).toEqual({ x: 0, y: 0, w: 12, h: 4 });
  });

  test("spreads over a wider screen, in order, and is as it was on a desk", () => {
    const wide = spread(panels, 12, 24);
    expect(wide.map(({ x, y, w }) => [x, y, w])).toEqual([
      [0, 0, 6],
      [6, 0, 6],
      [12, 0, 12],
    ]);
    expect(spread(panels, 12, 18).map(({ x, y }) => [x, y])).toEqual([
      [0, 0],
      [6, 0],
      [0, 4],
    ]);
    expect(spread(panels, 12, 12)).toEqual(panels);
  });

  test("that was arranged on a wide screen stays there, and finds room on a desk", () => {
    const arranged = put(spread(panels, 12, 24), "a", { x: 20, w: 4 }, 24);
    expect(overlaps(arranged)).toBe(0);
    expect(arranged.find(({ id }) => id === "a")).toMatchObject({ x: 20, w: 4, y: 0 });
    expect(spread(arranged, 24, 24)).toEqual(arranged);
    const folded = spread(arranged, 24, 12);
    expect(overlaps(folded)).toBe(0);
    expect(folded.every(({ x, w }) => x + w <= 12)).toBe(true);
    expect(folded.map(({ id }) => id)).toEqual(["a", "b", "c"]);
    expect(spread([{ id: "a", x: 0, y: 0, w: 24, h: 4 }], 24, 12)).toEqual([{ id: "a", x: 0, y: 0, w: 12, h: 4 }]);
  });
});
