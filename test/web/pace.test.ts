// How often something comes, and when it is late.
import { Pace } from "../../web/src/live/pace";
import { formatRate } from "../../web/src/live/rate";

describe("a pace", () => {
  test("is stale after three periods, and never where there is none", () => {
    const pace = new Pace();
    for (let t = 0; t <= 1000; t += 200) pace.hear(t);
    expect(pace.periodMs).toBe(200);
    expect(pace.isStale(1590)).toBe(false);
    expect(pace.isStale(1610)).toBe(true);
    expect(pace.rate(1610)).toBe(0);
    const once = new Pace();
    once.hear(0);
    expect(once.isStale(1e6)).toBe(false);
  });

  /** What is said at the end, and the most that is ever said on the way. */
  const rates = (times: readonly number[]): { last: number; most: number } => {
    const pace = new Pace();
    const said = times.map((t) => (pace.hear(t), pace.rate(t)));
    return { last: said.at(-1) ?? 0, most: Math.max(...said) };
  };
  const every = (ms: number, from: number, to: number): number[] =>
    Array.from({ length: Math.floor((to - from) / ms) + 1 }, (_, i) => from + i * ms);
  /** `count` within `takesMs`, beginning at each of `starts`. */
  const bursts = (starts: readonly number[], count: number, takesMs: number): number[] =>
    starts.flatMap((start) => every(takesMs / count, start, start + takesMs).slice(0, count));

  test.each([
    ["single ones, fast", every(1, 0, 5_000), 1_000],
    ["single ones", every(50, 0, 5_000), 20],
    ["single ones, slow", every(5_000, 0, 20_000), 0.2],
    ["bursts at once", bursts(every(500, 0, 5_000), 10, 1), 20],
    ["bursts of some time", bursts(every(500, 0, 5_000), 50, 100), 100],
    ["bursts that are rare", bursts(every(5_000, 0, 20_000), 100, 30), 20],
    [
      "what a busy page hears late",
      [...every(10, 0, 5_000), ...bursts([6_000], 100, 20), ...every(10, 6_020, 9_000)],
      100,
    ],
    [
      "what waited while the page slept",
      [...every(10, 0, 3_000), ...bursts([60_000], 5_000, 400), ...every(10, 60_400, 64_000)],
      100,
    ],
    ["a backlog, then single ones", [...bursts([0], 300, 200), ...every(50, 200, 4_000)], 20],
    ["single ones with a pause", [...every(50, 0, 1_000), ...every(50, 60_000, 61_500)], 20],
  ])("has the rate of what comes over time: %s", (_, times, rate) => {
    const { last, most } = rates(times);
    expect(last).toBeGreaterThan(rate * 0.9);
    expect(last).toBeLessThan(rate * 1.1);
    expect(most).toBeLessThan(rate * 2);
  });

  test("has a rate in words that is as long for 9.96 as for 10.04", () => {
    expect([0.2, 9.94, 9.96, 10.04, 123.4].map(formatRate)).toEqual(["0.2", "9.9", "10", "10", "123"]);
  });

  test("has no rate of a single burst", () => {
    expect(rates(bursts([0], 50, 120)).most).toBe(0);
    expect(rates([0, ...bursts([60_000], 50, 120)]).most).toBeLessThan(1);
  });

  test("of bursts is not stale between them", () => {
    const pace = new Pace();
    for (const t of bursts(every(500, 0, 3_000), 50, 20)) pace.hear(t);
    expect(pace.isStale(3_499)).toBe(false);
    expect(pace.isStale(4_600)).toBe(true);
  });
});
