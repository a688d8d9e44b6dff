// Limits for what has none of its own. Layer: wasm-client/ts.
import { makeError } from "./errors.js";
import type { CallOptions } from "./types.js";

/** An AbortController in its place is a common slip. @throws RobotRaconteurError InvalidArgument */
export function checkSignal(signal: AbortSignal | null | undefined): void {
  if (signal === undefined || signal === null || typeof signal.addEventListener === "function") return;
  throw makeError("InvalidArgument", "signal: expected an AbortSignal (the `signal` of an AbortController)");
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
    const timer =
      timeout === undefined
        ? undefined
        : setTimeout(() => reject(makeError("RequestTimeout", `${late} within ${timeout} ms`)), timeout);
    void promise.then(resolve, reject).finally(() => {
      clearTimeout(timer);
      signal?.removeEventListener("abort", abort);
    });
  });
}
