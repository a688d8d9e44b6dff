// Texts as people read them.
import { flowing, timeText } from "../../web/src/ui/words";

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
