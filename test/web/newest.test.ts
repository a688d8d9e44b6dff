// Pictures that come faster than they are drawn.
import { newestOf } from "../../web/src/camera/newest";

/** What comes when the test says so. */
function makeSource() {
  const waiting: ((step: Promise<IteratorResult<number, void>>) => void)[] = [];
  const closed = vi.fn();
  async function* values(): AsyncGenerator<number, void> {
    try {
      for (;;) {
        const step = await new Promise<IteratorResult<number, void>>((resolve) => waiting.push(resolve));
        if (step.done) return;
        yield step.value;
      }
    } finally {
      closed();
    }
  }
  const settle = async () => {
    for (let i = 0; i < 10; i++) await Promise.resolve();
  };
  const tell = async (step: Promise<IteratorResult<number, void>>) => {
    await settle();
    step.catch(() => undefined);
    waiting.shift()?.(step);
    await settle();
  };
  return {
    values: newestOf(values()),
    closed,
    send: (value: number) => tell(Promise.resolve({ done: false, value })),
    end: () => tell(Promise.resolve({ done: true, value: undefined })),
    fail: (error: Error) => tell(Promise.reject(error)),
  };
}

describe("the newest", () => {
  it("is what came last while the one before was drawn", async () => {
    const { values, send } = makeSource();
    const first = values.next();
    await send(1);
    expect((await first).value).toBe(1);
    for (const value of [2, 3, 4]) await send(value);
    expect((await values.next()).value).toBe(4);
    const later = values.next();
    await send(5);
    expect((await later).value).toBe(5);
  });
  it("ends as what it is of, behind the last", async () => {
    const { values, send, end } = makeSource();
    const first = values.next();
    await send(1);
    await first;
    await send(2);
    await end();
    expect([await values.next(), await values.next()]).toEqual([
      { done: false, value: 2 },
      { done: true, value: undefined },
    ]);
  });
  it("fails as what it is of, behind the last", async () => {
    const { values, send, fail } = makeSource();
    const first = values.next();
    await send(1);
    await first;
    await send(2);
    await fail(new Error("gone"));
    expect((await values.next()).value).toBe(2);
    await expect(values.next()).rejects.toThrow("gone");
  });
  it("closes what it is of where its reader leaves", async () => {
    const { values, closed, send } = makeSource();
    const first = values.next();
    await send(1);
    await first;
    await values.return();
    await send(2);
    expect(closed).toHaveBeenCalledOnce();
  });
});
