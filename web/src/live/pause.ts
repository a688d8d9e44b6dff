// Waiting that ends early. Layer: web/live.

const FIRST_RETRY_MS = 1_000;
const LONGEST_RETRY_MS = 30_000;

/** Ends early with `signal`, and leaves nothing at it: one signal lasts as long as a connection. */
export function pause(ms: number, signal: AbortSignal): Promise<void> {
  return new Promise((resolve) => {
    const end = (): void => {
      clearTimeout(timer);
      signal.removeEventListener("abort", end);
      resolve();
    };
    const timer = setTimeout(end, ms);
    signal.addEventListener("abort", end, { once: true });
    if (signal.aborted) end();
  });
}

/**
 * Does `work` until it succeeds: what fails is tried again, more and more rarely.
 * `failed`  hears why, but for an end by `signal`; true: something came before, so that it begins with short waits anew.
 */
export async function untilDone(
  work: () => Promise<void>,
  failed: (error: unknown) => boolean | void,
  signal: AbortSignal,
): Promise<void> {
  for (let waits = FIRST_RETRY_MS; !signal.aborted; waits = Math.min(LONGEST_RETRY_MS, waits * 2)) {
    try {
      await work();
      return;
    } catch (error) {
      if (signal.aborted) return;
      if (failed(error) === true) waits = FIRST_RETRY_MS;
    }
    await pause(waits, signal);
  }
}
