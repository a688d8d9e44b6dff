// What is typed in for generators and pipes, and what became of a run, over outages.
import { clear, enter, find, press, settle, text } from "./shown";
import { showPanel } from "./panels";
import { memberOf } from "./members";
import GeneratorPanel from "../../web/src/panels/generator_panel";
import PipePanel from "../../web/src/panels/pipe_panel";
import type { Member, Remote } from "../../web/src/robot/remote";

afterEach(clear);

const fields = () => [...document.querySelectorAll<HTMLInputElement>("input.field")];
const type = async (...texts: string[]): Promise<void> => {
  for (const [i, each] of texts.entries()) await enter(fields()[i] as HTMLInputElement, each);
};

describe("a generator", () => {
  const moveOf = (...parameters: string[]): Member[] => [
    {
      ...memberOf("function", "double{generator}", "move"),
      parameters: parameters.map((name) => ({ name, type: name === "pace" ? "double{generator}" : "double" })),
    },
  ];
  /** Answers no step. */
  const robotOf = () => {
    const next = vi.fn((_: unknown) => new Promise(() => undefined));
    const generate = vi.fn(() => ({ next, return: () => new Promise(() => undefined) }));
    return { object: { generate } as unknown as Remote, generate, next };
  };

  test("is given by name what was typed in before an outage", async () => {
    const update = showPanel(GeneratorPanel, robotOf().object, moveOf("speed", "distance", "pace"));
    await settle();
    await type("0.1", "5", "7");
    await update({ object: null });
    const { object, generate, next } = robotOf();
    await update({ object, members: moveOf("distance", "speed", "angle", "pace") });
    expect(fields().map(({ value }) => value)).toEqual(["5", "0.1", "0", "7"]);
    await enter(fields()[2] as HTMLInputElement, "3");
    await press("Run");
    expect(generate).toHaveBeenCalledWith("move", [5, 0.1, 3]);
    expect(next).toHaveBeenCalledWith(7);
  });

  test("says which input is wrong", async () => {
    showPanel(GeneratorPanel, robotOf().object, moveOf("speed", "distance"));
    await settle();
    await type("1", "far");
    await press("Run");
    expect(text()).toContain('distance: "far" is not a number');
  });

  test("that was lost with the connection may still run, also when the device is back", async () => {
    const update = showPanel(GeneratorPanel, robotOf().object, moveOf("speed"));
    await settle();
    await press("Run");
    await update({ object: null });
    const state = () => find("[data-run]").dataset["run"];
    expect(state()).toBe("not stopped");
    await update({ object: robotOf().object, members: moveOf("speed") });
    expect(state()).toBe("not stopped");
    expect(text()).toContain("it may still run");
  });
});

test("a pipe is sent nothing that was typed in for another type", async () => {
  const send = vi.fn(() => Promise.resolve());
  const openPipe = () => Promise.resolve({ isClosed: false, send, close: () => Promise.resolve() });
  const pipe = async function* () {
    yield* [];
    await new Promise(() => undefined);
  };
  const object = { openPipe, pipe } as unknown as Remote;
  const update = showPanel(PipePanel, object, [memberOf("pipe", "double", "goal")]);
  await settle();
  await type("0.1");
  await update({ object: { ...object }, members: [memberOf("pipe", "double", "goal")] });
  expect(fields().map(({ value }) => value)).toEqual(["0.1"]);
  await update({ object: { ...object }, members: [memberOf("pipe", "int32", "goal")] });
  expect(fields().map(({ value }) => value)).toEqual(["0"]);
  expect(text()).toContain("Emptied, since its type has changed: goal");
  await type("4");
  await press("Send goal");
  expect(send).toHaveBeenCalledWith(4);
});
