// The newest of what comes, for who is slower than it comes. Layer: web/camera, pure.

/** Takes what comes at once, and yields the newest when it is asked; older ones are dropped. Ends and fails as `values` does. */
export async function* newestOf<T>(values: AsyncGenerator<T, void>): AsyncGenerator<T, void> {
  let newest: { value: T } | null = null;
  let isOver = false;
  let wake = (): void => undefined;
  const take = async (): Promise<void> => {
    try {
      for await (const value of values) {
        newest = { value };
        wake();
      }
    } finally {
      isOver = true;
      wake();
    }
  };
  const taking = take();
  taking.catch(() => undefined); // told below, once what came before is taken
  const next = (): { value: T } | null => {
    const found = newest;
    newest = null;
    return found;
  };
  try {
    for (;;) {
      const found = next();
      if (found) yield found.value;
      else if (isOver) return await taking;
      else await new Promise<void>((resolve) => (wake = resolve));
    }
  } finally {
    values.return().catch(() => undefined); // with the next that comes: it may be waiting for that
  }
}
