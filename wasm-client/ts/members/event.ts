// Events: listeners, the next one, or a loop over all. Layer: wasm-client/ts/members. Source: sessions spec section 2.9.
import { makeError } from "../errors.js";
import { releasedObject } from "../session.js";
import type { EventMember, RrValue } from "../types.js";
import { after, checkSignal } from "../within.js";
import type { MemberContext } from "./member.js";
import { queueLimits, ValueQueue } from "./queue.js";

/** What a loop may be behind. Events are never dropped silently: a loop that is slower ends with an error. */
const { limit, maxBytes } = queueLimits;

export function makeEvent({ session, path, info, isReleased }: MemberContext): EventMember {
  const listen = (onEvent: (args: RrValue[]) => void) => session.listen(path, info.name, { onEvent });
  return Object.freeze({
    on: (listener: (...args: RrValue[]) => void) => {
      if (typeof listener === "function") return listen((args) => listener(...args));
      throw makeError("InvalidArgument", `${info.name}.on: found ${typeof listener}, expected a function`);
    },

    once: ({ signal, timeout } = {}) =>
      new Promise((resolve, reject) => {
        checkSignal(signal);
        if (signal?.aborted) return reject(signal.reason);
        if (isReleased()) return reject(releasedObject(path));
        const end = () => {
          stopListening();
          stopClosing();
          clearTimeout(timer);
          signal?.removeEventListener("abort", abort);
        };
        const fail = (reason: unknown) => (end(), reject(reason));
        const abort = () => fail(signal?.reason);
        const stopListening = listen((args) => (end(), resolve(args)));
        const stopClosing = session.onEnd(path, (reason) => fail(reason ?? closedHere()));
        const timer = after(timeout, () =>
          fail(makeError("RequestTimeout", `no event ${info.name} within ${timeout} ms`)),
        );
        signal?.addEventListener("abort", abort, { once: true });
      }),

    [Symbol.asyncIterator]: () => {
      const end = () => {
        stopListening();
        stopClosing();
      };
      const overflow = () => {
        end();
        const what = `more than ${limit} events ${info.name} or ${maxBytes} bytes of them wait`;
        return makeError("OutOfSystemResource", `${what} and nobody takes them`);
      };
      const queue = new ValueQueue<RrValue[]>(limit, end, overflow, maxBytes);
      const stopListening = listen((args) => queue.push(args));
      const stopClosing = session.onEnd(path, (reason) => (reason ? queue.fail(reason) : queue.end()));
      if (isReleased()) {
        end();
        queue.fail(releasedObject(path));
      }
      return queue;
    },
  } satisfies EventMember);
}

const closedHere = () => makeError("ConnectionError", "the session was closed by this side");
