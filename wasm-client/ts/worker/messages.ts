// What page and worker say to one another. Layer: wasm-client/ts/worker.
import type { ErrorFields } from "../errors.js";
import type { Proof } from "../platform.js";
import type { MemberInfo, RrValue, SessionStats } from "../types.js";
import type { CoreEvent, CoreOptions, KnownDefinitions } from "../wasm_module.js";
import type { Cargo } from "./passage.js";

/** To the worker, whose answers come over `port`. */
export type ToThread =
  /** The first one; `wasm`: see init(). Answered with "done". */
  | { kind: "start"; wasm: unknown; port: MessagePort }
  /** Answered with "done" or "refused". */
  | { kind: "preload"; port: MessagePort }
  /** One connection: answered with "made" or "refused", later "opened" or "lost". */
  | { kind: "open"; url: string; proof: Proof; port: MessagePort };

/** To one connection. */
export type ToHost = { marks?: Cargo["marks"] } & (
  | { kind: "core"; options: CoreOptions }
  /**
   * A method of the core. `isRequest`: what completes it is an event; else it is answered at once. `size`: see
   * News.taken.
   */
  | {
      kind: "call";
      id: number;
      method: string;
      args: unknown[];
      isRequest: boolean;
      isUrgent: boolean;
      timeout: number;
      size: number;
    }
  | { kind: "cancel"; id: number }
  /** The page has dealt with the last news: the next may come. */
  | { kind: "taken" }
  | { kind: "close" }
);

export type FromHost = { marks?: Cargo["marks"] } & (
  | { kind: "done" }
  | { kind: "made" }
  | { kind: "refused"; error: ErrorFields }
  | { kind: "opened" }
  | { kind: "lost"; reason: string }
  /** The core is there. */
  | { kind: "core" }
  | News
);

/** One at a time: see Outbox. */
export interface News {
  kind: "news";
  events: HostEvent[];
  stats: SessionStats;
  /** Bytes that wait for the network, in the transport and in the core. */
  queued: number;
  /** Sum of the sizes of all calls that have arrived. */
  taken: number;
}

/** Those of the core, and what became of calls. */
export type HostEvent = { seen?: Seen } & (
  | CoreEvent
  | { kind: "answered"; id: number; value: unknown }
  /** The core does not take it: nothing was sent. */
  | { kind: "refused"; id: number; error: ErrorFields }
);

/** What can be looked at, as of an event. */
export interface Seen {
  peer?: { id: string; name: string };
  attributes?: Map<string, RrValue>;
  definitions?: string[];
  members?: { path: string; members: MemberInfo[] };
  wantsClose?: boolean;
  known?: KnownDefinitions;
}
