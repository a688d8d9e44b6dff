// One connection in the worker: transport, core, and what page and core have to tell one another. Layer: wasm-client/ts/worker.
import { errorFields, makeError, RobotRaconteurError, textOf } from "../errors.js";
import { lookTimer, roomMark, transmit } from "../outflow.js";
import type { LookTimer } from "../outflow.js";
import type { Proof } from "../platform.js";
import type { Transport, TransportListener } from "../transport.js";
import type { RrValue, SessionStats } from "../types.js";
import { Core, noStats, preload } from "../wasm_module.js";
import type { CoreEvent, CoreOptions } from "../wasm_module.js";
import type { FromHost, Seen, ToHost } from "./messages.js";
import { Outbox } from "./outbox.js";
import { restore } from "./passage.js";

export type OpenHosted = (url: URL, listener: TransportListener, proof: Proof) => Transport | Promise<Transport>;

type CallMessage = ToHost & { kind: "call" };
/** Methods of the core, as messages name them. */
type Methods = Record<string, (...args: unknown[]) => unknown>;

/** Of one member, that may wait for the page: of pipes, where connect() says nothing else. */
const waitLimit = 10_000;
const waitBytes = 64 * 1024 * 1024;

export class Host {
  #transport: Transport | undefined;
  #core: Core | undefined;
  #timer: LookTimer | undefined;
  #service = "";
  /** Comes before the core is there. */
  readonly #early: Uint8Array[] = [];
  #lost: string | undefined;
  /** There is no more to be told than what waits. */
  #isOver = false;
  readonly #outbox = new Outbox();
  /** News are on their way, and the page has not dealt with them. */
  #isTelling = false;
  /** Requests by the number of the core, and its numbers by those of the page. */
  readonly #requests = new Map<number, CallMessage>();
  readonly #numbers = new Map<number, number>();
  /** Pipes and locks that the page asked for and may give up yet, as it has not taken the answer, by its numbers. */
  readonly #untaken = new Map<number, { call: CallMessage; value: unknown }>();
  /** Those whose answer the page is told. */
  #toldAnswers: number[] = [];
  /** Limits of endpoints by line. */
  readonly #limits = new Map<string, { limit: number; maxBytes: number }>();
  /** Lines of endpoints that were closed here: what still comes is nobody's. */
  readonly #overflown = new Set<string>();
  /** Values of wires that were replaced here, by "path.member". */
  readonly #conflated = new Map<string, number>();
  #definitionCount = -1;
  /** The newest, also of a core that is no more. */
  #stats: SessionStats = noStats;
  #taken = 0;
  #told = { queued: 0, taken: 0 };

  constructor(
    private readonly port: MessagePort,
    private readonly openTransport: OpenHosted,
  ) {
    port.onmessage = ({ data }: MessageEvent<ToHost>) => this.#handle(data);
  }

  async open(url: string, proof: Proof): Promise<void> {
    void preload().catch(() => undefined); // while the socket opens; Core.create() says what is wrong
    const listener: TransportListener = {
      opened: () => this.#say({ kind: "opened" }),
      received: (bytes) => this.#handleBytes(bytes),
      closed: (reason) => this.#handleLost(reason),
    };
    try {
      this.#transport = await this.openTransport(new URL(url), listener, proof);
      this.#say({ kind: "made" });
    } catch (error) {
      this.#say({ kind: "refused", error: errorFields(error) });
      this.port.close(); // there is no transport that the page could close
    }
  }

  // --- news from outside ---

  #handle(message: ToHost): void {
    restore(message.marks);
    switch (message.kind) {
      case "core":
        void this.#createCore(message.options);
        break;
      case "call":
        this.#taken += message.size;
        this.#guarded((core) => this.#call(core, message));
        this.#pump();
        break;
      case "cancel":
        this.#cancel(message.id);
        break;
      case "taken":
        this.#isTelling = false;
        for (const id of this.#toldAnswers.splice(0)) this.#untaken.delete(id);
        this.#tell();
        break;
      case "close":
        this.#stop();
        this.port.close();
        break;
    }
  }

  #handleBytes(bytes: Uint8Array): void {
    if (!this.#core) return void this.#early.push(bytes.slice());
    this.#guarded((core) => core.handleBytes(bytes));
    this.#pump();
  }

  #handleLost(reason: string): void {
    this.#lost = reason;
    if (!this.#core) return this.#say({ kind: "lost", reason });
    this.#guarded((core) => core.handleClosed(reason));
    this.#pump();
  }

  async #createCore(options: CoreOptions): Promise<void> {
    try {
      this.#core = await Core.create(options);
    } catch (error) {
      return this.#say({ kind: "refused", error: errorFields(error) });
    }
    if (this.#isOver) return;
    this.#service = options.service;
    this.#timer = lookTimer(
      this.#transport as Transport,
      () => (this.#core as Core).pollTimeout(),
      () => {
        this.#guarded((core) => core.handleTimeout());
        this.#pump();
      },
    );
    this.#say({ kind: "core" });
    for (const bytes of this.#early.splice(0)) this.#guarded((core) => core.handleBytes(bytes));
    const lost = this.#lost;
    if (lost !== undefined) this.#guarded((core) => core.handleClosed(lost));
    this.#pump();
  }

  // --- what the page asks ---

  #call(core: Core, call: CallMessage): void {
    const { id, method, args, isRequest, timeout, isUrgent } = call;
    try {
      if (isRequest) core.prepareRequest(timeout, isUrgent);
      if (method === "sendPipePacket") args.push((number: number) => this.#answer(id, number));
      if (method === "stepGenerator") args.push(() => undefined);
      const result = (core as unknown as Methods)[method]!(...args);
      if (isRequest) {
        this.#requests.set(result as number, call);
        this.#numbers.set(id, result as number);
      } else if (method !== "sendPipePacket") {
        this.#answer(id, result);
      }
      if (method === "connectWire") this.#conflated.delete(args.join("."));
    } catch (error) {
      if (!(error instanceof RobotRaconteurError)) throw error; // a trap
      this.#outbox.push({ kind: "refused", id, error: errorFields(error) });
    }
  }

  #answer(id: number, value: unknown): void {
    this.#outbox.push({ kind: "answered", id, value });
  }

  #cancel(id: number): void {
    const number = this.#numbers.get(id);
    this.#numbers.delete(id);
    if (number !== undefined) this.#requests.delete(number);
    this.#guarded((core) => (number === undefined ? this.#undo(core, id) : core.cancel(number)));
    this.#pump();
  }

  /** What the page gave up while the answer was on its way lasts no longer. */
  #undo(core: Core, id: number): void {
    const { call, value } = this.#untaken.get(id) ?? {};
    if (!call) return;
    this.#untaken.delete(id);
    const [path, member] = call.args as [string, string];
    if (call.method === "lock") core.unlock(path);
    else core.disconnectPipe(path, member, Number(value));
  }

  // --- the pump ---

  #pump(): void {
    this.#guarded((core) => {
      for (;;) {
        this.#transmit(core);
        const event = core.pollEvent();
        if (!event) break;
        this.#hand(core, event);
        if (this.#isOver) break;
      }
    });
    if (!this.#isOver) this.#timer?.arm();
    this.#tell();
  }

  #transmit(core: Core): void {
    const transmitted = (size: number) => core.handleTransmitted(size);
    transmit(this.#transport as Transport, () => core.pollTransmit(), transmitted);
  }

  /** Puts an event of the core among what waits for the page. */
  #hand(core: Core, event: CoreEvent): void {
    switch (event.kind) {
      case "connected": {
        const look = { peer: core.peer(), attributes: core.attributes(), ...this.#look(core, this.#service) };
        this.#outbox.push({ ...event, seen: look });
        break;
      }
      case "completed":
      case "failed":
        this.#complete(core, event);
        break;
      case "wire": {
        const wire = `${event.path}.${event.member}`;
        if (this.#outbox.pushNewest(event, wire)) this.#conflated.set(wire, (this.#conflated.get(wire) ?? 0) + 1);
        break;
      }
      case "wire_closed":
        this.#outbox.keep(`${event.path}.${event.member}`);
        this.#outbox.push(event);
        break;
      case "pipe":
        this.#handPacket(core, event);
        break;
      case "pipe_closed":
        this.#limits.delete(lineOf(event));
        this.#outbox.push(event);
        break;
      case "event":
      case "callback": {
        const { count, size } = this.#outbox.push(event, `${event.kind} ${event.path} ${event.member}`);
        if (count <= waitLimit && size <= waitBytes) break;
        const what = `${count} times ${event.kind} ${event.member} waits in the worker and the page takes none`;
        this.#fail(makeError("OutOfSystemResource", `${what}: the session is closed`));
        break;
      }
      case "closed":
        this.#end(event);
        break;
      default:
        this.#outbox.push(event);
    }
  }

  #handPacket(core: Core, event: CoreEvent & { kind: "pipe" }): void {
    const line = lineOf(event);
    if (this.#overflown.has(line)) return;
    const { limit, maxBytes } = this.#limits.get(line) ?? { limit: waitLimit, maxBytes: waitBytes };
    const { count, size } = this.#outbox.push(event, line);
    if (count <= limit && (size <= maxBytes || count === 1)) return;
    this.#overflown.add(line);
    this.#limits.delete(line);
    const { path, member, index } = event;
    const what = `more than ${limit} packets or ${maxBytes} bytes of pipe ${member} wait in the worker`;
    const error = makeError("OutOfSystemResource", `${what} and the page takes none: the endpoint is closed`);
    this.#outbox.push({ kind: "pipe_closed", path, member, index, error: errorFields(error) });
    core.disconnectPipe(path, member, index); // what becomes of it concerns nobody
  }

  #complete(core: Core, event: CoreEvent & { kind: "completed" | "failed" }): void {
    const call = this.#requests.get(event.id);
    if (!call) return;
    this.#requests.delete(event.id);
    this.#numbers.delete(call.id);
    const own = { ...event, id: call.id };
    if (own.kind === "failed") return void this.#outbox.push({ ...own, seen: { wantsClose: core.wantsClose() } });
    if (call.method === "connectPipe" || call.method === "lock") this.#untaken.set(call.id, { call, value: own.value });
    const [path, member, , limits] = call.args as [string, string, number, { limit?: number; maxBytes?: number }];
    switch (call.method) {
      case "findObject":
        this.#outbox.push({ ...own, seen: this.#look(core, path) });
        return;
      case "connectPipe": {
        const line = lineOf({ path, member, index: Number(own.value) });
        this.#overflown.delete(line);
        this.#limits.set(line, { limit: limits.limit ?? waitLimit, maxBytes: limits.maxBytes ?? waitBytes });
        break;
      }
      case "connectWire":
        this.#outbox.keep(`${path}.${member}`);
        break;
      case "getAttributes":
        this.#count(own.value);
        break;
    }
    this.#outbox.push(own);
  }

  /** What was delivered to this side and replaced here did not reach the page. Source: losses/losses.ts. */
  #count(attributes: RrValue): void {
    const all = attributes instanceof Map ? attributes.get("rrgate.subscriptions" as never) : undefined;
    if (!((all as unknown) instanceof Map)) return;
    for (const [wire, count] of this.#conflated) {
      const numbers = (all as unknown as Map<string, RrValue>).get(wire);
      if (!(numbers instanceof Float64Array)) continue;
      numbers[0]! -= count;
      numbers[1]! += count;
    }
  }

  /** What an object that was found shows of itself, and definitions that have come with it. */
  #look(core: Core, path: string): Seen {
    const seen: Seen = { members: { path, members: core.members(path) } };
    const definitions = core.definitions();
    if (definitions.length === this.#definitionCount) return seen;
    this.#definitionCount = definitions.length;
    return { ...seen, definitions };
  }

  // --- to the page ---

  /** One batch at a time: while the page is busy, newer values replace those that wait. */
  #tell(): void {
    const core = this.#core;
    if (!core || this.#isTelling || (this.#outbox.isEmpty && !this.#hasRoomAgain(core))) return;
    this.#isTelling = true;
    const { events, cargo } = this.#outbox.take();
    this.#toldAnswers = events.flatMap((event) => (event.kind === "completed" ? [event.id] : []));
    this.#told = { queued: this.#queued(core), taken: this.#taken };
    if (!this.#isOver) this.#stats = core.stats();
    const news = { kind: "news", events, stats: this.#stats, ...this.#told, marks: cargo.marks } as const;
    this.port.postMessage(news satisfies FromHost, cargo.transfer);
  }

  /** The page may hold senders back for want of room, and there is some. */
  #hasRoomAgain(core: Core): boolean {
    const asPageSees = this.#told.queued + this.#taken - this.#told.taken;
    return asPageSees >= roomMark && !this.#isOver && this.#queued(core) < roomMark;
  }

  #queued(core: Core): number {
    return this.#isOver ? 0 : (this.#transport as Transport).buffered + core.queuedBytes();
  }

  #say(message: FromHost): void {
    this.port.postMessage(message);
  }

  // --- the end ---

  #end(event: CoreEvent & { kind: "closed" }): void {
    const core = this.#core as Core;
    this.#outbox.push({ ...event, seen: { wantsClose: core.wantsClose(), known: core.knownDefinitions() } });
    this.#stats = core.stats();
    this.#stop();
  }

  /** This side ends the session, in order as far as that goes. */
  #fail(error: RobotRaconteurError): void {
    const core = this.#core as Core;
    core.disconnect();
    this.#transmit(core);
    this.#end({ kind: "closed", error: errorFields(error) });
  }

  #stop(): void {
    if (this.#isOver) return;
    this.#isOver = true;
    this.#timer?.stop();
    this.#transport?.close();
  }

  /** An exception here is a trap in the core (memory at its end) or a broken transport: the session is over. */
  #guarded(what: (core: Core) => void): void {
    if (!this.#core || this.#isOver) return;
    try {
      what(this.#core);
    } catch (error) {
      const reason = makeError("InternalError", `the session failed: ${textOf(error)}`);
      this.#outbox.push({ kind: "closed", error: errorFields(reason) });
      this.#stop();
    }
  }
}

const lineOf = ({ path, member, index }: { path: string; member: string; index: number }) =>
  `pipe ${path} ${member} ${index}`;
