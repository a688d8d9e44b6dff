// Events: listeners, the next one, or a loop over all. Layer: wasm-client/ts/members. Source: sessions spec section 2.9.
import { make_error } from "../errors.js";
import type { EventMember, RrValue } from "../types.js";
import { check_signal } from "../within.js";
import type { MemberContext } from "./member.js";
import { ValueQueue } from "./queue.js";

/** Events that a loop may be behind. They are never dropped silently: a loop that is slower ends with an error. */
const queue_limit = 10_000;

export function make_event({ session, path, info }: MemberContext): EventMember {
  const listen = (on_event: (args: RrValue[]) => void) => session.listen(path, info.name, { on_event });
  return Object.freeze({
    on: (listener: (...args: RrValue[]) => void) => {
      if (typeof listener === "function") return listen((args) => listener(...args));
      throw make_error("InvalidArgument", `${info.name}.on: found ${typeof listener}, expected a function`);
    },

    once: ({ signal, timeout } = {}) =>
      new Promise((resolve, reject) => {
        check_signal(signal);
        if (signal?.aborted) return reject(signal.reason);
        const end = () => {
          stop_listening();
          stop_closing();
          clearTimeout(timer);
          signal?.removeEventListener("abort", abort);
        };
        const fail = (reason: unknown) => (end(), reject(reason));
        const abort = () => fail(signal?.reason);
        const stop_listening = listen((args) => (end(), resolve(args)));
        const stop_closing = session.on_close((reason) => fail(reason ?? closed_here()));
        const timer =
          timeout === undefined
            ? undefined
            : setTimeout(() => fail(make_error("RequestTimeout", `no event ${info.name} within ${timeout} ms`)), timeout);
        signal?.addEventListener("abort", abort, { once: true });
      }),

    [Symbol.asyncIterator]: () => {
      const end = () => {
        stop_listening();
        stop_closing();
      };
      const queue = new ValueQueue<RrValue[]>(queue_limit, end, () => {
        end();
        return make_error("OutOfSystemResource", `${queue_limit} events ${info.name} wait and nobody takes them`);
      });
      const stop_listening = listen((args) => queue.push(args));
      const stop_closing = session.on_close((reason) => (reason ? queue.fail(reason) : queue.end()));
      return queue;
    },
  } satisfies EventMember);
}

const closed_here = () => make_error("ConnectionError", "the session was closed by this side");
