// connect(): from a URL to an object. Layer: wasm-client/ts.
import { makeError } from "./errors.js";
import { ObjectTree } from "./object.js";
import { checkTimeout, Session } from "./session.js";
import type { Proof } from "./platform.js";
import type { CoreTransport, OpenTransport, Transport } from "./transport.js";
import type { ObjectInfo, RemoteObject } from "./types.js";
import { parseServiceUrl } from "./url.js";
import { openUsb } from "./usb_devices.js";
import { Core, preload } from "./wasm_module.js";
import type { KnownDefinitions } from "./wasm_module.js";
import { openWebsocket } from "./websocket.js";
import { after, checkSignal } from "./within.js";

/** Asked for the URL at each attempt, so that each can have a ticket of its own. */
export type UrlSource = () => string | URL | Promise<string | URL>;

export interface ConnectOptions extends Proof {
  /** Gives up connecting. Once connected it has no effect; use `$.close()`. */
  signal?: AbortSignal | undefined;
  /** Milliseconds for everything until the session is up; 30,000. */
  timeout?: number | undefined;
  /** Milliseconds for each request that brings no limit of its own; 15,000. */
  requestTimeout?: number | undefined;
  username?: string | undefined;
  /** Stands for `credentials: {password}`. */
  password?: string | undefined;
  /** What the service's authenticator wants to see, as varvalues. */
  credentials?: Record<string, unknown> | ReadonlyMap<string, unknown> | undefined;
  /** Uses the root object as this type, which it must implement: "com.example.Robot". */
  objectType?: string | undefined;
  /** Messages above this many bytes end the session; 12 MiB. */
  maxMessageSize?: number | undefined;
  /** The name of this client's node, as services see it. */
  nodeName?: string | undefined;
  /** For tests and peers with a gap: the newest message version to offer (4), and whether to offer string tables. */
  version?: 2 | 4 | undefined;
  stringTable?: boolean | undefined;
  /** Carries the bytes instead of a WebSocket or a USB device. */
  transport?: OpenTransport | undefined;
  /** Has protocol, WebSocket and WebAssembly in a worker, as rrgate-client/worker; not where there is a `transport`. */
  worker?: boolean | undefined;
}

const defaultConnectTimeout = 30_000;
const defaultRequestTimeout = 15_000;

/** A root object; `await using` ends its session. */
export type Client<T> = T & { readonly $: InfoOf<T> } & AsyncDisposable;

/** Of generated types their own. */
type InfoOf<T> = T extends { readonly $: infer I extends ObjectInfo } ? I : ObjectInfo<T>;

/** What stays from one connection of a subscription to the next. */
export interface Memory {
  known: KnownDefinitions;
}

/**
 * Connects to a service.
 * @param url "wss://host/devices/create?service=Create"; schemes ws, wss, http, https, rr+ws, rr+wss, rr+tcp (the port
 *            of a node takes WebSockets too); in a page also relative to it. "rr+usb:///?nodename=robot&service=Create" for
 *            a USB device that the page may use (see requestUsbDevice()), where the browser has WebUSB. Or a function
 *            that gives it.
 * @returns   the service's root object, once the session is up.
 * @throws    RobotRaconteurError InvalidArgument (URL, options), ConnectionError, ServiceNotFound, NodeNotFound,
 *            AuthenticationError, RequestTimeout, ...; the reason of `signal`; what the function throws.
 */
export function connect<T = RemoteObject>(
  url: string | URL | UrlSource,
  options: ConnectOptions = {},
): Promise<Client<T>> {
  return connectWith<T>(url, options);
}

/** As connect(). A service that has the definitions in `memory` does not send them again; in the end others are there. */
export async function connectWith<T>(
  url: string | URL | UrlSource,
  options: ConnectOptions,
  memory?: Memory,
): Promise<Client<T>> {
  const { signal } = options;
  checkSignal(signal);
  signal?.throwIfAborted();
  const timeout = checkTimeout(options.timeout ?? defaultConnectTimeout);
  const requestTimeout = checkTimeout(options.requestTimeout ?? defaultRequestTimeout, "requestTimeout");
  if (options.username === undefined && (options.password ?? options.credentials) !== undefined) {
    // Without it there would be a session, but nobody's.
    throw makeError("InvalidArgument", "found a password or credentials without username");
  }

  if (!options.worker) void preload().catch(() => undefined); // while the socket opens; Core.create() says what is wrong
  const attempt = new Attempt();
  const abort = () => attempt.fail(signal?.reason);
  signal?.addEventListener("abort", abort);
  let where = "the function that gives the URL";
  const timer = after(timeout, () =>
    attempt.fail(makeError("RequestTimeout", `${where}: no session within ${timeout} ms`)),
  );
  try {
    const given = typeof url === "function" ? await attempt.unlessFailed((async () => url())()) : url;
    const { address, service, nodeId, nodeName } = parseServiceUrl(given);
    where = address.host || address.href;
    const open: OpenTransport =
      options.transport ??
      (options.worker
        ? (await attempt.unlessFailed(import("./worker/thread.js"))).openInWorker(options)
        : address.protocol === "rr+usb:"
          ? openUsb
          : (to, listener) => openWebsocket(to, listener, options));
    const { createCore = Core.create } = await attempt.open(address, open);
    const core = await attempt.unlessFailed(
      createCore({
        service,
        nodeId,
        nodeName,
        selfName: options.nodeName,
        username: options.username,
        credentials:
          options.credentials ?? (options.password === undefined ? undefined : { password: options.password }),
        objectType: options.objectType,
        version: options.version,
        stringTable: options.stringTable,
        connectTimeout: timeout,
        maxMessageSize: options.maxMessageSize,
        known: memory?.known,
      }),
    );
    const session = attempt.begin(core, requestTimeout);
    if (memory) session.onClose(() => !session.isBroken && (memory.known = core.knownDefinitions()));
    const type = await attempt.unlessFailed(session.start());
    return new ObjectTree(session).root(service, type) as Client<T>;
  } catch (error) {
    attempt.fail(error);
    throw error;
  } finally {
    clearTimeout(timer);
    signal?.removeEventListener("abort", abort);
  }
}

/** What exists of a connection so far, and the way to end it at any point. */
class Attempt {
  #transport: Transport | undefined;
  #session: Session | undefined;
  /** Comes before the core is there, if a peer speaks first. */
  #early: Uint8Array[] = [];
  #hasFailed = false;
  readonly #failure: Promise<never>;
  #reject!: (reason: unknown) => void;

  constructor() {
    this.#failure = new Promise((_, reject) => (this.#reject = reject));
    this.#failure.catch(() => undefined);
  }

  async open(url: URL, open: OpenTransport): Promise<Transport & Partial<CoreTransport>> {
    let opened!: () => void;
    const isOpen = new Promise<void>((resolve) => (opened = resolve));
    const opening = Promise.resolve(
      open(url, {
        opened,
        received: (bytes) => {
          if (this.#session) this.#session.received(bytes);
          else this.#early.push(bytes.slice());
        },
        closed: (reason) => {
          if (this.#session) this.#session.lost(reason);
          else this.fail(makeError("ConnectionError", reason));
        },
      }),
    );
    void opening.then(
      (transport) => {
        this.#transport = transport;
        if (this.#hasFailed) transport.close();
      },
      () => undefined,
    );
    const transport = await this.unlessFailed(opening);
    await this.unlessFailed(isOpen);
    return transport;
  }

  begin(core: Core, timeout: number): Session {
    const session = new Session(core, this.#transport as Transport, timeout);
    this.#session = session;
    for (const bytes of this.#early.splice(0)) session.received(bytes);
    return session;
  }

  unlessFailed<T>(step: Promise<T>): Promise<T> {
    return Promise.race([step, this.#failure]);
  }

  /** Ends what there is; the first reason counts. */
  fail(reason: unknown): void {
    if (this.#hasFailed) return;
    this.#hasFailed = true;
    this.#reject(reason);
    if (this.#session) void this.#session.close();
    else this.#transport?.close();
  }
}
