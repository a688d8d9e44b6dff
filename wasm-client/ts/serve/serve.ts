/**
 * A page as a device: its camera, motion and touch as a Robot Raconteur service that a gateway lists.
 * @module
 */
import { Backoff } from "../clock.js";
import { asyncDispose } from "../dispose.js";
import { callSafely, makeError, textOf } from "../errors.js";
import { platform } from "../platform.js";
import type { Proof } from "../platform.js";
import type { Transport } from "../transport.js";
import { parseServiceUrl } from "../url.js";
import { openWebsocket } from "../websocket.js";
import { after, within } from "../within.js";
import type { Caller, Implementation, ServedObject } from "./served_object.js";
import { Service } from "./service.js";

export type { AskedMemory, Memory, MultiDimMemory } from "./memories.js";
export type { Caller, ServedEndpoint, ServedObject, ServedPipe } from "./served_object.js";

export interface ServeOptions extends Proof {
  /** Where the gateway is: "wss://host", in a page also relative to it. Or a function that is asked each time. */
  url: string | URL | (() => string | URL | Promise<string | URL>);
  /** The device's name in the gateway: letters, digits, "_", "-", ".". */
  name: string;
  /** The service's definition, and those that it imports, in any order. */
  definition: string | readonly string[];
  /** The type of the root object, qualified: "com.example.phone.Phone". */
  type: string;
  /** The root object: its members by their names. */
  object: object;
  /** The name of the service; the last part of `type`. */
  service?: string | undefined;
  /** The node's UUID; another one for each call of serve(). */
  nodeId?: string | undefined;
  /** Milliseconds until the gateway has taken the device, from the call of `url` on, and for each later attempt; 30,000. */
  timeout?: number | undefined;
  /** Gives up. Once the page is a device it has no effect; use close(). */
  signal?: AbortSignal | undefined;
  /** Hears of each change of ServedDevice.isServed, but for close(). */
  onChange?: ((isServed: boolean, reason: string) => void) | undefined;
  /** Messages above this many bytes end a client's session; 12 MiB. */
  maxMessageSize?: number | undefined;
}

/** A page that is a device until close(). A connection that is lost is made again. */
export interface ServedDevice extends AsyncDisposable {
  readonly name: string;
  readonly nodeId: string;
  /** Whether the gateway has it now. */
  readonly isServed: boolean;
  /** The root object. */
  readonly root: ServedObject;
  /** The client whose request is answered; to be read before the first await. */
  readonly caller: Caller | undefined;
  /** Tells all clients by an event of the root object. */
  emit(event: string, ...args: unknown[]): void;
  /** Takes leave of the clients and the gateway. */
  close(): Promise<void>;
}

const subprotocol = "rrgate.serve.v1";
const defaultTimeoutMs = 30_000;
const defaultMessageSize = 12 * 1024 * 1024;
const firstWaitMs = 250;
const longestWaitMs = 10_000;

/**
 * Makes this page a device of a gateway. Its configuration needs `"serve": {}`, and where rights are given, the page's
 * user `serve` for the name.
 * @throws RobotRaconteurError (rejects) InvalidArgument; ServiceDefinitionError; ConnectionError: the gateway is not
 *         reached, or says no (the message has its reason); RequestTimeout; AuthenticationError; the reason of `signal`.
 */
export async function serve(options: ServeOptions): Promise<ServedDevice> {
  const { name, definition, type, nodeId = randomId() } = options;
  const service = await Service.create(
    {
      nodeId,
      nodeName: /^[A-Za-z][A-Za-z0-9_.-]*$/.test(name) ? name : "",
      service: options.service ?? type.slice(type.lastIndexOf(".") + 1),
      type,
      definitions: typeof definition === "string" ? [definition] : definition,
      maxMessageSize: options.maxMessageSize ?? defaultMessageSize,
    },
    options.object as Implementation,
  );
  const device = new Device(service, options, nodeId);
  await device.begin();
  return device;
}

class Device implements ServedDevice {
  readonly name: string;
  #isServed = false;
  #closed: Promise<void> | undefined;
  /** Of the newest attempt. */
  #ending: AbortController | undefined;
  #socket: WebSocket | undefined;
  #wait: ReturnType<typeof setTimeout> | undefined;
  readonly #backoff = new Backoff(firstWaitMs, longestWaitMs, Math.random);

  constructor(
    private readonly service: Service,
    private readonly options: ServeOptions,
    readonly nodeId: string,
  ) {
    this.name = options.name;
  }

  get isServed(): boolean {
    return this.#isServed;
  }
  get root(): ServedObject {
    return this.service.root;
  }
  get caller(): Caller | undefined {
    return this.service.caller;
  }

  emit(event: string, ...args: unknown[]): void {
    this.root.emit(event, ...args);
  }

  /** The first attempt. */
  async begin(): Promise<void> {
    const { signal } = this.options;
    signal?.throwIfAborted();
    try {
      await this.#attempt(signal);
    } catch (error) {
      await this.close();
      throw error;
    }
  }

  close(): Promise<void> {
    return (this.#closed ??= this.#end());
  }

  [asyncDispose](): Promise<void> {
    return this.close();
  }

  async #end(): Promise<void> {
    this.#isServed = false;
    clearTimeout(this.#wait);
    this.#ending?.abort(makeError("OperationCancelled", "the device was closed"));
    await Promise.resolve(); // what finds an object may close the device: its core is free behind that
    this.service.close();
    this.#socket?.close(1000);
  }

  /** Resolves once the gateway has taken the device. */
  async #attempt(signal?: AbortSignal): Promise<void> {
    const { url: source, name, timeout = defaultTimeoutMs } = this.options;
    const ending = (this.#ending = new AbortController());
    const unlessEnded = <T>(step: Promise<T>) => within(step, { signal: ending.signal }, "");
    let where = "the function that gives the URL";
    let socket: WebSocket | undefined;
    const abort = () => ending.abort(signal?.reason);
    signal?.addEventListener("abort", abort, { once: true });
    const timer = after(timeout, () =>
      ending.abort(makeError("RequestTimeout", `${where}: no answer within ${timeout} ms`)),
    );
    try {
      const given = typeof source === "function" ? await unlessEnded(Promise.resolve().then(source)) : source;
      const url = serveUrl(given, name);
      where = `${url.protocol}//${url.host}${url.pathname}`;
      const SocketClass = await unlessEnded(platform.findWebsocket(url, this.options));
      socket = new SocketClass(url.href, [subprotocol]);
      this.#socket = socket;
      await unlessEnded(this.#taken(socket, url, where));
    } catch (error) {
      socket?.close();
      throw error;
    } finally {
      clearTimeout(timer);
      signal?.removeEventListener("abort", abort);
    }
  }

  /** Resolves when the gateway says by `socket` that it has the device, and follows what it says later. */
  #taken(socket: WebSocket, url: URL, where: string): Promise<void> {
    return new Promise<void>((resolve, reject) => {
      socket.addEventListener("message", ({ data }: MessageEvent) => {
        const message = JSON.parse(String(data)) as { served?: string; open?: string };
        if (message.open !== undefined) void this.#open(url, message.open);
        if (message.served === undefined) return;
        this.#backoff.reset();
        this.#change(true, "");
        resolve();
      });
      socket.addEventListener("close", ({ reason, code }: CloseEvent) => {
        const why = reason || `could not connect, or was closed (WebSocket code ${code})`;
        const wasServed = this.#isServed && this.#socket === socket;
        if (wasServed) this.#lost(why);
        reject(makeError("ConnectionError", `${where}: ${why}`));
      });
    });
  }

  /** A connection that the gateway wants, for itself or for one of its clients. */
  async #open(control: URL, key: string): Promise<void> {
    const url = new URL(control);
    url.search = "";
    url.searchParams.set("key", key);
    // As its clients reach it, but for those who come to the gateway by another name.
    const deviceUrl = `rr+${url.protocol}//${url.host}${url.pathname.replace(/serve(?=\/[^/]*$)/, "devices")}`;
    const early: Uint8Array[] = [];
    let client: ReturnType<Service["add"]> | undefined;
    let transport: Transport | undefined;
    let isOpen = false;
    const begin = () => {
      if (!transport || !isOpen || client) return;
      if (this.#closed) return transport.close();
      client = this.service.add(transport, deviceUrl);
      for (const bytes of early.splice(0)) client.received(bytes);
    };
    const listener = {
      opened: () => ((isOpen = true), begin()),
      received: (bytes: Uint8Array) => void (client ? client.received(bytes) : early.push(bytes.slice())),
      closed: (reason: string) => client?.closed(reason),
    };
    try {
      transport = await openWebsocket(url, listener);
      begin();
    } catch {
      // The gateway hears of it in that none comes.
    }
  }

  #lost(reason: string): void {
    this.#change(false, reason);
    this.#tryLater();
  }

  #tryLater(): void {
    if (this.#closed) return;
    this.#wait = setTimeout(() => {
      this.#attempt().catch((error: unknown) => {
        if (this.#closed) return;
        callSafely(() => this.options.onChange?.(false, textOf(error)));
        this.#tryLater();
      });
    }, this.#backoff.next());
  }

  #change(isServed: boolean, reason: string): void {
    if (this.#closed || this.#isServed === isServed) return;
    this.#isServed = isServed;
    callSafely(() => this.options.onChange?.(isServed, reason));
  }
}

/** The gateway may be below a path. */
function serveUrl(gateway: string | URL, name: string): URL {
  const [place, query] = String(gateway).split("?", 2) as [string, string | undefined];
  const base = place.endsWith("/") ? place : `${place}/`;
  // Of a service it has the form that schemes and pages are read by.
  const { address } = parseServiceUrl(`${base}serve/${encodeURIComponent(name)}?service=x`);
  address.search = query ?? "";
  return address;
}

/** Pages that came without encryption have no crypto.randomUUID(). */
function randomId(): string {
  const hex = Array.from(crypto.getRandomValues(new Uint8Array(16)), (byte, i) =>
    (i === 6 ? (byte & 0x0f) | 0x40 : i === 8 ? (byte & 0x3f) | 0x80 : byte).toString(16).padStart(2, "0"),
  ).join("");
  return hex.replace(/^(.{8})(.{4})(.{4})(.{4})/, "$1-$2-$3-$4-");
}
