// A board as a text: in an address, in a file, kept by this browser.
import {
  formatBoard,
  isTooLong,
  packBoard,
  parseBoard,
  recallBoard,
  sameBoard,
  unpackBoard,
  writeBoard,
} from "../../web/src/board/board";
import type { Board } from "../../web/src/board/board";
import { Keeper } from "../../web/src/board/keeper";

describe("a board", () => {
  const board = parseBoard(
    '{"board":1,"stop":{"call":"halt"},"panels":[{"kind":"notes","x":0,"y":9,"w":3,"h":5,"title":"für","settings":{"text":"a"}}]}',
  );

  test("goes through an address and comes back, settled", () => {
    expect(board.panels[0]?.y).toBe(0);
    const packed = packBoard(board);
    expect(packed).toMatch(/^[\w-]+$/);
    expect(writeBoard(unpackBoard(packed))).toEqual(writeBoard(board));
    const wide = '{"board":1,"columns":24,"panels":[{"kind":"notes","x":20,"y":0,"w":4,"h":5}]}';
    expect(JSON.stringify(writeBoard(parseBoard(wide)))).toContain('"columns":24');
    expect(unpackBoard(packBoard(parseBoard(wide))).panels[0]).toMatchObject({ x: 20, w: 4 });
    expect(() => unpackBoard("%%%")).toThrow("the board in it is cut off or changed");
  });

  test("is refused with what is wrong, where, and what was expected", () => {
    for (const [file, words] of [
      ["[]", "the file is [], expected an object { … }"],
      ['{"board":2}', 'field "board" is 2, expected 1'],
      [
        '{"board":1,"panels":[{"kind":"notes","x":-1,"y":0,"w":1,"h":1}]}',
        "/panels/0/x is -1, expected a whole number from 0",
      ],
      [
        '{"board":1,"panels":[{"kind":"notes","from":"100%","x":0,"y":0,"w":1,"h":1}]}',
        '/panels/0/from is "100%", expected "device/service", each percent-encoded',
      ],
      [
        '{"board":1,"panels":[{"kind":"notes","from":"arm","x":0,"y":0,"w":1,"h":1}]}',
        '/panels/0/from is "arm", expected "device/service"',
      ],
      ['{"board":1,"panels":[],"stop":{"call":1}}', "/stop/call is 1, expected the name of a function"],
      ['{"board":1,"columns":11,"panels":[]}', 'field "columns" is 11, expected a whole number from 12 to 24'],
      ["{", "the file is no JSON"],
    ] as const)
      expect(() => parseBoard(file), file).toThrow(words);
  });

  test("is too long where the file that is made of it could not be read again", () => {
    const path = (count: number): Board => ({
      ...board,
      panels: board.panels.map((panel) => ({ ...panel, settings: { path: Array(count).fill(0) } })),
    });
    const [short, long] = [path(70_000), path(90_000)]; // each number has a line of its own
    expect(isTooLong(short)).toBe(false);
    expect(writeBoard(parseBoard(formatBoard(short)))).toEqual(writeBoard(short));
    expect(isTooLong(long)).toBe(true);
    expect(() => parseBoard(formatBoard(long))).toThrow("expected at most 1048576");
  });

  test("that this browser keeps and cannot read any more is no board", () => {
    expect(recallBoard("x", { getItem: () => "{}" })).toBeNull();
    expect(recallBoard("x", { getItem: () => JSON.stringify(writeBoard(board)) })?.stop?.call).toBe("halt");
  });
});

test("a board is written at once and then not too often, and the address only while it is the board's", () => {
  vi.useFakeTimers();
  const written: string[] = [];
  const write = (text: string) => ({ store: () => written.push(text), show: () => written.push(`#${text}`) });
  const keeper = new Keeper();
  for (let i = 0; i < 300; i++) keeper.write(write(String(i)));
  expect([...written, keeper.isKept.value]).toEqual(["0", "#0", false]);
  vi.advanceTimersByTime(399);
  expect(written).toHaveLength(2);
  vi.advanceTimersByTime(10_000);
  expect([...written.splice(0), keeper.isKept.value]).toEqual(["0", "#0", "299", "#299", true]);
  keeper.write(write("now"));
  keeper.write(write("left"));
  keeper.flush(false);
  vi.advanceTimersByTime(10_000);
  expect(written).toEqual(["now", "#now", "left"]);
  vi.useRealTimers();
  const [one, other] = ["a", "b"].map((title) =>
    parseBoard(`{"board":1,"panels":[{"kind":"notes","x":0,"y":0,"w":3,"h":5,"title":"${title}"}]}`),
  ) as [Board, Board];
  expect([sameBoard(one, { ...one, panels: [...one.panels] }), sameBoard(one, other)]).toEqual([true, false]);
});
