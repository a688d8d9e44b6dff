// The core as the page's session sees it, where it is in a worker: what is asked of it becomes a message, and what it has to
// tell comes in messages. Layer: wasm-client/ts/worker.
import { errorFields, makeError, report, RobotRaconteurError } from "../errors.js";
import type { ErrorFields } from "../errors.js";
import { isWithin } from "../session.js";
import type { PipeConnectOptions } from "../types.js";
import { noStats } from "../wasm_module.js";
import type { Core, CoreEvent, GeneratorStep, RawDefinition } from "../wasm_module.js";
import type { HostEvent, News, Seen, ToHost } from "./messages.js";
import { copyOf, weigh } from "./passage.js";

/** As many bytes may wait in the core for the network. */
const sendLimit = 32 * 1024 * 1024;

/** What awaits the answer to a call that is no request. */
interface Call {
  answered(value: unknown): void;
  refused(reason: unknown): void;
}

export class RemoteCore {
  readonly #events: HostEvent[] = [];
  readonly #calls = new Map<number, Call>();
  /** Of requests: told once the core has taken them. */
  readonly #takers = new Map<number, () => void>();
  /** Requests for a wire, by path and name, that nobody has answered. */
  readonly #wires = new Map<string, number>();
  readonly #members = new Map<string, Seen["members"]>();
  #seen: Seen = {};
  #stats: News["stats"] = noStats;
  #lastId = 0;
  #timeout = 0;
  #isUrgent = false;
  #isOver = false;
  /** Sizes of calls: sent in all, and what the worker says that it has taken of it. */
  #sent = 0;
  #taken = 0;
  #queued = 0;

  constructor(private readonly post: (message: ToHost, transfer?: ArrayBuffer[]) => void) {}

  take(news: News): void {
    this.#events.push(...news.events);
    this.#stats = news.stats;
    this.#queued = news.queued;
    this.#taken = news.taken;
  }

  // --- told: the worker hears of it by itself ---

  handleBytes(): void {}
  handleTimeout(): void {}
  handleTransmitted(): void {}
  handleClosed(): void {}

  // --- asked ---

  prepareRequest(timeout: number, isUrgent: boolean): void {
    this.#timeout = timeout;
    this.#isUrgent = isUrgent;
  }

  /** @returns the number of the request. */
  request(method: string, args: readonly unknown[]): number {
    return this.#post(method, args, true);
  }

  connectWire(path: string, member: string): number {
    const id = this.request("connectWire", [path, member]);
    this.#wires.set(`${path} ${member}`, id);
    return id;
  }

  connectPipe(path: string, member: string, index: number, { limit, maxBytes }: PipeConnectOptions = {}): number {
    return this.request("connectPipe", [path, member, index, { limit, maxBytes }]);
  }

  stepGenerator(
    step: GeneratorStep,
    path: string,
    member: string,
    index: number,
    parameter: unknown,
    sent: () => void,
  ): number {
    const id = this.request("stepGenerator", [step, path, member, index, parameter]);
    this.#takers.set(id, sent);
    return id;
  }

  async sendWire(path: string, member: string, value: unknown): Promise<void> {
    await this.#send("sendWire", [path, member, value]);
  }

  async sendPipePacket(
    path: string,
    member: string,
    index: number,
    value: unknown,
    wantsAck: boolean,
    sent: (number: number) => void,
  ): Promise<void> {
    await this.#send("sendPipePacket", [path, member, index, value, wantsAck], (number) => sent(number as number));
  }

  /** Nobody waits for it: what is refused is reported. */
  replyCallback(id: number, path: string, member: string, value: unknown): void {
    const refused = (error: unknown) => {
      if (!this.#isOver) report(error);
    };
    try {
      void this.#call("replyCallback", [id, path, member, value]).catch(refused);
    } catch (error) {
      this.failCallback(id, errorFields(error)); // the service waits
      throw error;
    }
  }

  failCallback(id: number, error: Partial<ErrorFields>): void {
    this.#post("failCallback", [id, error], false);
  }

  cancel(id: number): void {
    this.#forget(id);
    this.post({ kind: "cancel", id });
  }

  disconnect(): void {
    this.#post("disconnect", [], false);
  }

  // --- answers ---

  /** The worker sends by itself, and keeps its own time. */
  pollTransmit(): undefined {}

  pollTimeout(): number {
    return Infinity;
  }

  wantsClose(): boolean {
    return this.#seen.wantsClose ?? false;
  }

  pollEvent(): CoreEvent | undefined {
    for (let event = this.#events.shift(); event; event = this.#events.shift()) {
      const own = this.#read(event);
      if (own) return own;
    }
    return undefined;
  }

  // --- looked at, as of the event that was polled last ---

  queuedBytes(): number {
    return this.#queued + this.#sent - this.#taken;
  }

  /** As of the last news. */
  stats(): News["stats"] {
    return this.#stats;
  }

  peer(): Seen["peer"] {
    return this.#seen.peer;
  }

  attributes(): Seen["attributes"] {
    return this.#seen.attributes;
  }

  definitions(): string[] {
    return this.#seen.definitions ?? [];
  }

  knownDefinitions(): Seen["known"] {
    return this.#seen.known ?? [];
  }

  async definition(name: string): Promise<RawDefinition | undefined> {
    return (await this.#call("definition", [name])) as RawDefinition | undefined;
  }

  members(path: string): unknown {
    return this.#members.get(path)?.members ?? [];
  }

  /** Session's own, or nothing where it concerns this class alone. */
  #read(event: HostEvent): CoreEvent | undefined {
    this.#see(event.seen);
    switch (event.kind) {
      case "answered":
        this.#calls.get(event.id)?.answered(event.value);
        this.#calls.delete(event.id);
        return undefined;
      case "refused": {
        const call = this.#calls.get(event.id);
        if (!call) return { ...event, kind: "failed" };
        this.#calls.delete(event.id);
        call.refused(new RobotRaconteurError(event.error));
        return undefined;
      }
      case "completed":
      case "failed":
        this.#takers.get(event.id)?.();
        this.#forget(event.id);
        return event;
      case "wire_closed":
        // Where the page has asked for this wire again, it is the connection before that was closed.
        return this.#wires.has(`${event.path} ${event.member}`) ? undefined : event;
      case "path_released":
        for (const path of this.#members.keys()) if (isWithin(path, event.path)) this.#members.delete(path);
        return event;
      case "closed":
        this.#isOver = true;
        for (const { refused } of this.#calls.values()) refused(new RobotRaconteurError(event.error));
        this.#calls.clear();
        return event;
      default:
        return event;
    }
  }

  #see(seen: Seen | undefined): void {
    if (!seen) return;
    Object.assign(this.#seen, seen);
    if (seen.members) this.#members.set(seen.members.path, seen.members);
  }

  #forget(id: number): void {
    this.#takers.delete(id);
    for (const [wire, asked] of this.#wires) if (asked === id) this.#wires.delete(wire);
  }

  /** @throws RobotRaconteurError (rejects) OutOfSystemResource, what the core says. */
  #send(method: string, args: readonly unknown[], answered?: (value: unknown) => void): Promise<unknown> {
    if (this.queuedBytes() <= sendLimit) return this.#call(method, args, answered);
    throw makeError("OutOfSystemResource", `${sendLimit} bytes wait for the worker or the network`);
  }

  /** @param answered  called before the next event is polled. */
  #call(method: string, args: readonly unknown[], answered?: (value: unknown) => void): Promise<unknown> {
    const id = this.#post(method, args, false);
    return new Promise((resolve, reject) => {
      this.#calls.set(id, { answered: (value) => (answered?.(value), resolve(value)), refused: reject });
    });
  }

  #post(method: string, args: readonly unknown[], isRequest: boolean): number {
    const id = ++this.#lastId;
    const copies = args.map(copyOf);
    const { transfer, marks, size } = weigh(copies);
    this.#sent += size;
    const call = { kind: "call", id, method, args: copies, isRequest, size, marks } as const;
    this.post({ ...call, isUrgent: this.#isUrgent, timeout: this.#timeout }, transfer);
    return id;
  }
}

/** Requests that need nothing else: the method of Core has the same arguments. */
const requests = [
  "authenticate",
  "callFunction",
  "disconnectPipe",
  "disconnectWire",
  "enterMonitor",
  "exitMonitor",
  "findObject",
  "getAttributes",
  "getMemoryDimensions",
  "getProperty",
  "lease",
  "lock",
  "logout",
  "openGenerator",
  "peekInValue",
  "peekOutValue",
  "pokeOutValue",
  "readMemory",
  "setProperty",
  "unlock",
  "writeMemory",
] as const satisfies (keyof Core)[];

for (const method of requests) {
  Object.defineProperty(RemoteCore.prototype, method, {
    value(this: RemoteCore, ...args: unknown[]) {
      return this.request(method, args);
    },
  });
}
