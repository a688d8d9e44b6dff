// Runs of generators: stopped is what the device has said to be stopped.
import { GeneratorRun } from "../../web/src/panels/generator_run";

/** A generator in the hands of the test; as the client's, it answers one thing after another. */
function makeGenerator() {
  const answers: ((answer: IteratorResult<unknown, void> | Error) => void)[] = [];
  let last: Promise<unknown> = Promise.resolve();
  const step = (): Promise<IteratorResult<unknown, void>> => {
    const result = last.then(
      () =>
        new Promise<IteratorResult<unknown, void>>((resolve, reject) =>
          answers.push((answer) => (answer instanceof Error ? reject(answer) : resolve(answer))),
        ),
    );
    last = result.catch(() => undefined);
    return result;
  };
  const generator = { next: vi.fn(step), return: vi.fn(step) };
  const answer = (value: unknown) =>
    vi.waitFor(() => {
      const next = answers.shift();
      if (!next) throw new Error("nothing was asked");
      next(value instanceof Error ? value : { done: false, value });
    });
  return { generator: generator as never, next: generator.next, answer };
}

async function running() {
  const made = makeGenerator();
  const heard: unknown[] = [];
  const run = new GeneratorRun((value) => heard.push(value));
  const going = run.go(
    true,
    () => made.generator,
    () => 7,
  );
  await made.answer(1);
  await vi.waitFor(() => expect(made.next).toHaveBeenCalledTimes(2));
  return { ...made, run, going, heard };
}

describe("a run", () => {
  it("is stopping while the step before hangs, and stopped when the device has said so", async () => {
    const { run, answer, heard } = await running();
    void run.stop();
    await Promise.resolve();
    expect(run.state.value).toBe("stopping");
    await answer(2);
    await vi.waitFor(() => expect(heard).toEqual([1, 2]));
    expect(run.state.value).toBe("stopping");
    await answer(undefined);
    await vi.waitFor(() => expect(run.state.value).toBe("stopped"));
    expect([run.isFresh, run.failure.value]).toEqual([true, null]);
  });

  it("says why it was not stopped", async () => {
    const { run, answer } = await running();
    void run.stop();
    await answer(2);
    await answer(new Error("no right to close it"));
    await vi.waitFor(() => expect(run.state.value).toBe("not stopped"));
    expect(run.failure.value).toBe("no right to close it");
  });

  it("ends with the step that fails, also while it is being stopped", async () => {
    const one = await running();
    await one.answer(new Error("out of reach"));
    await one.going;
    expect([one.run.state.value, one.run.failure.value]).toEqual(["ended", "out of reach"]);
    const two = await running();
    void two.run.stop();
    await two.answer(new Error("out of reach"));
    await two.answer(undefined);
    await vi.waitFor(() => expect(two.run.state.value).toBe("ended"));
    expect(two.run.failure.value).toBe("out of reach");
  });

  it("steps once where it does not run by itself", async () => {
    const { generator, next, answer } = makeGenerator();
    const run = new GeneratorRun(() => undefined);
    const going = run.go(
      false,
      () => generator,
      () => 7,
    );
    await answer(1);
    await going;
    expect(run.state.value).toBe("held");
    expect(next.mock.calls).toEqual([[7]]);
  });
});
