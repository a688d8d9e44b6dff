// Events: listeners, the next one, or a loop over all. Layer: wasm-client/ts/members. Source: sessions spec section 2.9.
import { makeError } from "../errors.js";
import type { RobotRaconteurError } from "../errors.js";
import { closedHere } from "../session.js";
import type { EventMember, RrValue } from "../types.js";
import { within } from "../within.js";
import type { MemberContext } from "./member.js";
import { overflowError, queueLimits, ValueQueue } from "./queue.js";

/** What a loop may be behind. Events are never dropped silently: a loop that is slower ends with an error. */
const { limit, maxBytes } = queueLimits;

export function makeEvent({ session, path, info, isReleased }: MemberContext): EventMember {
  const listen = (onEvent: (args: RrValue[]) => void) => session.listen(path, info.name, { onEvent });
  const onEnd = (ended: (reason?: RobotRaconteurError) => void) => session.onEnd(path, isReleased(), ended);
  return Object.freeze({
    on: (listener: (...args: RrValue[]) => void) => {
      if (typeof listener === "function") return listen((args) => listener(...args));
      throw makeError("InvalidArgument", `${info.name}.on: found ${typeof listener}, expected a function`);
    },

    once: (limits = {}) => {
      let end!: () => void;
      const next = new Promise<RrValue[]>((resolve, reject) => {
        const stopListening = listen(resolve);
        const stopClosing = onEnd((reason) => reject(reason ?? closedHere()));
        end = () => (stopListening(), stopClosing(), resolve([])); // nobody waits for it any more
      });
      return within(next, limits, `no event ${info.name}`).finally(end);
    },

    [Symbol.asyncIterator]: () => {
      const end = () => {
        stopListening();
        stopClosing();
      };
      const overflow = () => {
        end();
        return overflowError(info.name, limit, maxBytes);
      };
      const queue = new ValueQueue<RrValue[]>(limit, end, overflow, maxBytes);
      const stopListening = listen((args) => queue.push(args));
      const stopClosing = onEnd((reason) => (reason ? queue.fail(reason) : queue.end()));
      return queue;
    },
  } satisfies EventMember);
}
