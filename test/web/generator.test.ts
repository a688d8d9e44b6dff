// Runs of generators: stopped is what the device has said to be stopped.
import { ErrorCode, RobotRaconteurError } from "../../wasm-client/dist/index.js";
import { GeneratorRun } from "../../web/src/panels/generator_run";

const aborted = { code: ErrorCode.OperationAborted, name: "RobotRaconteur.OperationAborted", message: "closed" };

/** A generator in the hands of the test; as the client's, its end waits for no step, and rejects the one under way. */
function makeGenerator() {
  type Answer = IteratorResult<unknown, void> | Error;
  const answers: ((answer: Answer) => void)[] = [];
  const ask = (): Promise<IteratorResult<unknown, void>> =>
    new Promise((resolve, reject) =>
      answers.push((answer) => (answer instanceof Error ? reject(answer) : resolve(answer))),
    );
  const end = (): Promise<IteratorResult<unknown, void>> => {
    for (const step of answers.splice(0)) step(new RobotRaconteurError(aborted));
    return ask();
  };
  const generator = { next: vi.fn(ask), return: vi.fn(end) };
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
  it("is stopping until the device has said so, and the step under way is no failure", async () => {
    const { run, going, answer, heard } = await running();
    void run.stop();
    await going;
    expect([run.state.value, run.failure.value]).toEqual(["stopping", null]);
    await answer(undefined);
    await vi.waitFor(() => expect(run.state.value).toBe("stopped"));
    expect([run.isFresh, run.failure.value, heard]).toEqual([true, null, [1]]);
  });

  it("says why it was not stopped", async () => {
    const { run, answer } = await running();
    void run.stop();
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
    const failing = two.answer(new Error("out of reach"));
    void two.run.stop();
    await failing;
    await two.answer(undefined);
    await vi.waitFor(() => expect(two.run.state.value).toBe("ended"));
    expect(two.run.failure.value).toBe("out of reach");
  });

  it("is not said to be stopped where the connection is gone", async () => {
    const { run, next, generator } = await running();
    run.leave();
    expect([run.state.value, run.failure.value]).toEqual(["not stopped", "the connection is gone: it may still run"]);
    expect((generator as { return: unknown }).return).toHaveBeenCalledOnce();
    expect(next).toHaveBeenCalledTimes(2);
    expect(run.isFresh).toBe(true);
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
