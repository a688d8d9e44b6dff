// Limits for what has none of its own. Layer: wasm-client/ts.
import { makeError } from "./errors.js";
import type { CallOptions } from "./types.js";

/** An AbortController in its place is a common slip. @throws RobotRaconteurError InvalidArgument */
export function checkSignal(signal: AbortSignal | null | undefined): void {
  if (signal === undefined || signal === null || typeof signal.addEventListener === "function") return;
  throw makeError("InvalidArgument", "signal: expected an AbortSignal (the `signal` of an AbortController)");
}

/** setTimeout() calls at once where it is given more. */
const longestTimerMs = 2 ** 31 - 1;

/** Calls `due` after so many milliseconds; never without any. Infinity and the like: after 24 days. */
export function after(milliseconds: number | undefined, due: () => void): ReturnType<typeof setTimeout> | undefined {
  return milliseconds === undefined ? undefined : setTimeout(due, Math.min(milliseconds, longestTimerMs));
}

/**
 * What `promise` brings, unless its signal or time comes first.
 * @param late  what the error of a time-out says: "`late` within 100 ms".
 */
export function within<T>(promise: Promise<T>, { signal, timeout }: CallOptions, late: string): Promise<T> {
  if (signal === undefined && timeout === undefined) return promise;
  return new Promise((resolve, reject) => {
    checkSignal(signal);
    if (signal?.aborted) reject(signal.reason);
    const abort = () => reject(signal?.reason);
    signal?.addEventListener("abort", abort, { once: true });
    const timer = after(timeout, () => reject(makeError("RequestTimeout", `${late} within ${timeout} ms`)));
    void promise.then(resolve, reject).finally(() => {
      clearTimeout(timer);
      signal?.removeEventListener("abort", abort);
    });
  });
}
