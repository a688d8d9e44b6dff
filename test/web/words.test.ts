// Texts as people read them.
import { ended, flowing, sentence, span, staleAge, timeText } from "../../web/src/ui/words";

it("documentation flows where only its lines were broken, and lists and paragraphs stay", () => {
  expect(flowing("Drives on an arc\nuntil the next call.\n")).toBe("Drives on an arc until the next call.");
  const list = "Modes:\n- slow\n- fast\n\n1. first\n2. second";
  expect(flowing(list)).toBe(list);
  expect(flowing("one\n\ntwo\n  indented")).toBe("one\n\ntwo\n  indented");
});

it("times of a recording have minutes and tenths, and hours where it is long", () => {
  const times = [-1, 0, 4.24, 59.96, 750, 3600, 3750.04, 36000];
  expect(times.map(timeText)).toEqual([
    ...["0:00.0", "0:00.0", "0:04.2", "1:00.0", "12:30.0"],
    ...["1:00:00.0", "1:02:30.0", "10:00:00.0"],
  ]);
});

describe("words", () => {
  it("say within a second that no newer value came, and how old the last one is", () => {
    expect([0, 799].map(staleAge)).toEqual([null, null]);
    expect([800, 1400, 3000, 61_000].map(staleAge)).toEqual(["1 s old", "1 s old", "3 s old", "1 min old"]);
  });
  it("say spans as people do", () => {
    expect(span(4_999)).toBe("4 s");
    expect(span(61_000)).toBe("1 min");
    expect(span(7_500_000)).toBe("2 h 5 min");
    expect(span(-5)).toBe("0 s");
  });
  it("end sentences once", () => {
    expect(ended("refused")).toBe("refused.");
    expect(ended("refused. ")).toBe("refused.");
  });
  it("begin sentences with a capital, but change no names", () => {
    expect(sentence("refused")).toBe("Refused.");
    expect(sentence("user 'vera' has no right")).toBe("User 'vera' has no right.");
    expect(sentence("can't be reached, and so on")).toBe("Can't be reached, and so on.");
    for (const text of ["rr+tcp://h:1/ refused.", "gateway.json: broken.", "'arm' is away.", "create: no answer."])
      expect(sentence(text)).toBe(text);
  });
});
