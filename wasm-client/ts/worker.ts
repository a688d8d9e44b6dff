/**
 * rrgate-client with protocol, WebSocket and WebAssembly in a worker: a page that is busy delays no acknowledgement, and
 * large values are decoded elsewhere.
 * @module
 */
import { connect as connectWith } from "./connect.js";
import type { Client, ConnectOptions, UrlSource } from "./connect.js";
import { makeError } from "./errors.js";
import type { ServiceQuery } from "./find_services.js";
import { subscribe as subscribeWith } from "./subscribe.js";
import type { SubscribeOptions, Subscription } from "./subscribe.js";
import type { RemoteObject } from "./types.js";
import { openInWorker } from "./worker/thread.js";

export * from "./index.js";
export { init, preload } from "./worker/thread.js";
export type { WorkerInitOptions } from "./worker/thread.js";

/**
 * As connect() of rrgate-client.
 * @throws RobotRaconteurError as there; InvalidArgument: `transport`; SystemResourceError: the worker cannot be started.
 */
export async function connect<T = RemoteObject>(
  url: string | URL | UrlSource,
  options: ConnectOptions = {},
): Promise<Client<T>> {
  return connectWith<T>(url, inWorker(options));
}

/** As subscribe() of rrgate-client. @throws RobotRaconteurError as there; InvalidArgument: `transport`. */
export function subscribe<T = RemoteObject>(
  urls: string | URL | UrlSource | readonly (string | URL | UrlSource)[] | ServiceQuery,
  options: SubscribeOptions = {},
): Subscription<T> {
  return subscribeWith<T>(urls, inWorker(options));
}

function inWorker<O extends ConnectOptions>(options: O): O {
  if (!options.transport) return { ...options, worker: true, transport: openInWorker(options) };
  throw makeError("InvalidArgument", "transport: a worker can't use one of the page; use connect() of rrgate-client");
}
