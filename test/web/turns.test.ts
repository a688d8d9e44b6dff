// Drawing in turns: one a frame, in the order in which they asked.
import { drawInTurn, leaveTurn } from "../../web/src/chart/turns";

const frames: (() => void)[] = [];
vi.stubGlobal("requestAnimationFrame", (next: () => void) => frames.push(next));
const nextFrame = (): void => frames.shift()?.();

test("one draws in each frame, and who asks again comes behind the others", () => {
  const drawn: string[] = [];
  const [a, b, c] = ["a", "b", "c"].map((name) => (): void => void drawn.push(name)) as [
    () => void,
    () => void,
    () => void,
  ];
  drawInTurn(a);
  drawInTurn(b);
  drawInTurn(a);
  drawInTurn(c);
  expect(frames).toHaveLength(1);
  nextFrame();
  expect(drawn).toEqual(["a"]);
  drawInTurn(a);
  leaveTurn(c);
  nextFrame();
  nextFrame();
  expect(drawn).toEqual(["a", "b", "a"]);
  expect(frames).toHaveLength(0);
});

test("one that fails keeps nobody else from drawing", () => {
  const drawn: string[] = [];
  drawInTurn(() => {
    throw new Error("no canvas");
  });
  drawInTurn(() => void drawn.push("b"));
  expect(nextFrame).toThrow("no canvas");
  nextFrame();
  expect(drawn).toEqual(["b"]);
});
