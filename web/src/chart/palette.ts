// The colours of canvases, read from the style sheet so that light and dark are stated once.
// Layer: web/chart.

export interface Palette {
  sheet: string;
  ink: string;
  inkSoft: string;
  line: string;
  sea: string;
  seaLine: string;
  land: string;
  coast: string;
  accent: string;
  series: readonly string[];
  font: string;
}

export function readPalette(element: Element): Palette {
  const style = getComputedStyle(element);
  const colour = (name: string): string => style.getPropertyValue(name).trim() || "gray";
  return {
    sheet: colour("--sheet"),
    ink: colour("--ink"),
    inkSoft: colour("--ink-soft"),
    line: colour("--line"),
    sea: colour("--sea"),
    seaLine: colour("--sea-line"),
    land: colour("--land"),
    coast: colour("--coast"),
    accent: colour("--accent"),
    series: [1, 2, 3, 4, 5, 6].map((n) => colour(`--series-${n}`)),
    font: style.fontFamily,
  };
}
