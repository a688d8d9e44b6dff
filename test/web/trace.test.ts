// What a plot draws: its sources, their values over time, the file of them.
import { sharedUnit, sourcesOf, withSources } from "../../web/src/panels/plot_sources";
import { lonely, measuredAt, Trace, toCsv } from "../../web/src/panels/trace";

describe("plots", () => {
  test("keep what a window shows, and write a file that no spreadsheet runs", () => {
    const trace = new Trace(2);
    for (let i = 0; i <= 10; i++) trace.push(i * 1000, [i]);
    expect(trace.window(3)[0]).toEqual([-3, -2, -1, 0]);
    expect(toCsv(["time_s", '=A1,"x"'], new Trace(1))).toBe(`time_s,"'=A1,""x"""\n`);
    expect(toCsv(["t", "a", "b"], trace).split("\n")[2]).toBe("1,1,");
  });

  test("of several sources, each has cells where it was measured", () => {
    const trace = new Trace(2, 2);
    trace.push(0, [1], 0, 1);
    trace.push(500, [7], 1, 1);
    trace.push(1000, [2], 0, 1);
    trace.breakOff(1, 1);
    expect(trace.window(30)).toEqual([
      [-1, -0.5, 0, 0],
      [1, undefined, 2, undefined],
      [undefined, 7, undefined, null],
    ]);
    const [, first = [], second = []] = trace.window(30);
    expect([lonely(first), lonely(second)]).toEqual([null, [1]]);
    expect([measuredAt(first, 3), measuredAt(second, 0)]).toEqual([2, 1]);
    expect(toCsv(["t", "a", "b"], trace).split("\n")[2]).toBe("0.5,,7");
  });

  test("of several members are kept in the settings, which boards of one member have, too", () => {
    const before = { member: "state", paths: ["x"], seconds: 10 };
    const sources = sourcesOf(before, "packets");
    expect(sources).toEqual([{ member: "state", paths: ["x"] }]);
    expect(sourcesOf({}, "packets")).toEqual([{ member: "packets", paths: [] }]);
    const both = withSources(before, [...sources, { member: "speed", paths: [] }]);
    expect(both).toEqual({ ...before, more: [{ member: "speed" }] });
    expect(sourcesOf(both, "")).toEqual([...sources, { member: "speed", paths: [] }]);
    expect(withSources(both, sources)).toEqual(before);
    expect(sourcesOf({ member: "a", more: [7, null, { member: 1 }, { member: "a" }, { member: "b" }] }, "")).toEqual([
      { member: "a", paths: [] },
      { member: "b", paths: [] },
    ]);
    expect([sharedUnit(["mm", "mm"]), sharedUnit(["mm", ""]), sharedUnit([])]).toEqual(["mm", "", ""]);
  });

  test("draw no line over an outage, and leave out what is no finite number", () => {
    const trace = new Trace(2);
    trace.breakOff(); // nothing came before
    trace.push(0, [1, NaN]);
    trace.push(1000, [2, Infinity]);
    const before = trace.pushed;
    trace.breakOff();
    trace.push(9000, [3, 4]);
    expect(trace.pushed).toBe(before + 2);
    expect(trace.window(30)).toEqual([
      [-9, -8, -8, 0],
      [1, 2, null, 3],
      [null, null, null, 4],
    ]);
    expect(lonely(trace.window(30)[1] ?? [])).toEqual([3]);
    expect(lonely([1, 2, null])).toBeNull();
  });
});
