// Texts as people read them.
import { flowing } from "../../web/src/ui/words";

it("documentation flows where only its lines were broken, and lists and paragraphs stay", () => {
  expect(flowing("Drives on an arc\nuntil the next call.\n")).toBe("Drives on an arc until the next call.");
  const list = "Modes:\n- slow\n- fast\n\n1. first\n2. second";
  expect(flowing(list)).toBe(list);
  expect(flowing("one\n\ntwo\n  indented")).toBe("one\n\ntwo\n  indented");
});
