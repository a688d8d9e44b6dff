// The service of a page that is a device, and its clients: bytes in and out, timers, and who answers what. Layer:
// wasm-client/ts.
import { callSafely, makeError, report, RobotRaconteurError, textOf } from "../errors.js";
import { lookTimer, roomMark, transmit } from "../outflow.js";
import type { LookTimer } from "../outflow.js";
import type { Transport } from "../transport.js";
import type { MemberInfo, RrValue } from "../types.js";
import { Answers, childOf, keyOf, takeOutValue } from "./answers.js";
import { Caller, ServedEndpoint, ServedObject } from "./served_object.js";
import type { Implementation, ServiceOfObject } from "./served_object.js";
import { ServiceCore } from "./service_module.js";
import type { ServiceCall, ServiceEvent, ServiceOptions } from "./service_module.js";

/** An object that was found behind an objref. */
interface Found {
  readonly object: ServedObject;
  readonly parentPath: string;
  readonly objref: string;
  readonly key: string | number | undefined;
}

export class Service implements ServiceOfObject {
  #core!: ServiceCore;
  #root!: ServedObject;
  /** By their paths. */
  readonly #found = new Map<string, Found>();
  readonly #clients = new Map<number, ServedClient>();
  #caller: Caller | undefined;
  #isLooking = false;

  /** @throws RobotRaconteurError as ServiceCore.create(). */
  static async create(options: ServiceOptions, implementation: Implementation): Promise<Service> {
    const service = new Service();
    const members = new Map<string, MemberInfo>();
    service.#root = new ServedObject(service, options.service, options.type, implementation, members);
    service.#core = await ServiceCore.create(options, service.#root, (parent, member, index, path, type) =>
      service.#findChild(parent, member, index, path, type),
    );
    for (const member of service.#core.members(options.type)) members.set(member.name, member);
    return service;
  }

  get root(): ServedObject {
    return this.#root;
  }

  get caller(): Caller | undefined {
    return this.#caller;
  }

  /** A client comes by `transport`, which is open, to `url`. @returns what it is to be told of. */
  add(transport: Transport, url: string): { received(bytes: Uint8Array): void; closed(reason: string): void } {
    const client = new ServedClient(this, this.#core, transport, url);
    this.#clients.set(client.number, client);
    client.pump();
    return client;
  }

  /**
   * The core where it may be asked something: it waits for the answer while an objref is looked up.
   * @throws RobotRaconteurError InvalidOperation
   */
  get #free(): ServiceCore {
    if (!this.#isLooking) return this.#core;
    throw makeError("InvalidOperation", "what finds the object of an objref may not use members of the device");
  }

  forget(client: ServedClient): void {
    this.#clients.delete(client.number);
  }

  /** Tells all clients that the service ends. */
  close(): void {
    this.#free.closeService();
    this.pump();
  }

  // --- asked by objects ---

  emit(object: ServedObject, event: string, args: readonly unknown[]): void {
    this.#free.sendEvent(object, event, args);
    this.pump();
  }

  setWire(object: ServedObject, wire: string, value: unknown): void {
    this.#free.sendWire(0, object, wire, value);
    this.pump();
  }

  async sendPipe(endpoint: ServedEndpoint, value: unknown): Promise<void> {
    const client = this.#clients.get(endpoint.client);
    if (endpoint.isClosed || !client) throw makeError("InvalidOperation", "the pipe endpoint is closed");
    this.#free.sendPipe(endpoint.client, endpoint.id, value);
    client.pump();
    await client.room();
  }

  closePipe(endpoint: ServedEndpoint): void {
    this.#free.closePipe(endpoint.client, endpoint.id);
    this.#clients.get(endpoint.client)?.forgetPipe(endpoint);
  }

  callBack(number: number, object: ServedObject, callback: string, args: readonly unknown[]): Promise<RrValue> {
    return new Promise((resolve, reject) => {
      const client = this.#clients.get(number);
      if (!client) throw makeError("ConnectionError", "the client is gone");
      client.expect(this.#free.callCallback(number, object, callback, args), { resolve, reject });
      client.pump();
    });
  }

  release(parent: ServedObject, objref: string, index?: string | number): void {
    const core = this.#free;
    const key = index === undefined ? undefined : keyOf(parent, objref, String(index));
    // One pass: an object was found before those behind it. The core releases all spellings of an index at once.
    const gone = new Set<string>();
    const released = new Set<Found["key"]>();
    for (const [path, found] of this.#found) {
      const isMeant =
        found.parentPath === parent.path && found.objref === objref && (key === undefined || found.key === key);
      if (!isMeant && !gone.has(found.parentPath)) continue;
      gone.add(path);
      this.#found.delete(path);
      if (!isMeant || released.has(found.key)) continue;
      released.add(found.key);
      core.release(path);
    }
    this.pump();
  }

  // --- asked by clients ---

  /** Runs what answers a client, which may call the client back. */
  as<T>(client: number, what: () => T): T {
    this.#caller = new Caller(this, client);
    try {
      return what();
    } finally {
      this.#caller = undefined;
    }
  }

  #findChild(
    parent: ServedObject,
    member: string,
    index: string | undefined,
    path: string,
    type: string,
  ): ServedObject {
    this.#isLooking = true;
    let implementation: Implementation;
    try {
      implementation = childOf(parent, member, index);
    } finally {
      this.#isLooking = false;
    }
    const known = this.#found.get(path)?.object;
    if (known?.implementation === implementation) return known;
    // Where the definition leaves it open, or to say that it is more than that.
    const { rrType } = implementation;
    const own = typeof rrType === "string" ? rrType : type;
    const members = new Map(this.#core.members(own).map((each) => [each.name, each]));
    const object = new ServedObject(this, path, own, implementation, members);
    const key = keyOf(parent, member, index);
    this.#found.set(path, { object, parentPath: parent.path, objref: member, key });
    return object;
  }

  /** Asks all clients for what there is to send and to do. */
  pump(): void {
    for (const client of [...this.#clients.values()]) client.pump();
  }
}

interface Pending {
  resolve(value: RrValue): void;
  reject(reason: unknown): void;
}

/** One connection. */
class ServedClient {
  readonly number: number;
  #isOver = false;
  #isPumping = false;
  readonly #timer: LookTimer;
  readonly #answers = new Answers();
  readonly #pipes = new Map<number, ServedEndpoint>();
  readonly #callbacks = new Map<number, Pending>();
  #senders: (() => void)[] = [];

  constructor(
    private readonly service: Service,
    private readonly core: ServiceCore,
    private readonly transport: Transport,
    url: string,
  ) {
    this.number = core.open(url);
    this.#timer = lookTimer(
      transport,
      () => core.pollTimeout(this.number),
      () => {
        this.#guarded(() => core.handleTimeout(this.number));
        this.pump();
      },
    );
  }

  received(bytes: Uint8Array): void {
    if (this.#isOver) return;
    this.#guarded(() => this.core.handleBytes(this.number, bytes));
    this.pump();
  }

  closed(reason: string): void {
    if (this.#isOver) return;
    this.#guarded(() => this.core.handleClosed(this.number, reason));
    this.pump();
  }

  /** Nothing where there is room for more to send; else what resolves when there is, or the client is gone. */
  room(): Promise<void> | undefined {
    if (this.#isOver || this.#hasRoom()) return undefined;
    return new Promise((resolve) => this.#senders.push(resolve));
  }

  expect(callback: number, pending: Pending): void {
    this.#callbacks.set(callback, pending);
  }

  forgetPipe(endpoint: ServedEndpoint): void {
    this.#pipes.delete(endpoint.id);
    this.pump();
  }

  /** After whatever was told or asked: polls until nothing is left. */
  pump(): void {
    if (this.#isPumping || this.#isOver) return;
    this.#isPumping = true;
    this.#guarded(() => {
      for (;;) {
        this.#transmit();
        const event = this.core.pollEvent(this.number);
        if (!event || this.#isOver) break;
        this.#dispatch(event);
      }
    });
    this.#isPumping = false;
    if (!this.#isOver && this.core.wantsClose(this.number)) this.#finish();
    if (this.#isOver) return;
    if (this.#hasRoom()) for (const resolve of this.#senders.splice(0)) resolve();
    this.#timer.arm();
  }

  #hasRoom(): boolean {
    return this.transport.buffered + this.core.queuedBytes(this.number) < roomMark;
  }

  #transmit(): void {
    const { core, number } = this;
    const transmitted = (size: number) => core.handleTransmitted(number, size);
    transmit(this.transport, () => core.pollTransmit(number), transmitted);
  }

  #dispatch(event: ServiceEvent): void {
    switch (event.kind) {
      case "call":
        void this.#answer(event);
        break;
      case "wire_connected":
        if (event.object.inValues.has(event.member))
          this.core.sendWire(this.number, event.object, event.member, event.object.inValues.get(event.member));
        break;
      case "wire":
        callSafely(() => this.service.as(this.number, () => takeOutValue(event.object, event.member, event.value)));
        break;
      case "pipe_connected":
        this.#connectPipe(event);
        break;
      case "pipe":
        this.#pipes.get(event.id)?.take(event.value);
        break;
      case "pipe_closed":
        this.#pipes.get(event.id)?.closed();
        this.#pipes.delete(event.id);
        break;
      case "generator_ended":
        this.#answers.end(event.id);
        break;
      case "callback": {
        const pending = this.#callbacks.get(event.id);
        this.#callbacks.delete(event.id);
        if (event.error) pending?.reject(new RobotRaconteurError(event.error));
        else pending?.resolve(event.value ?? null);
        break;
      }
      case "locks_changed":
        this.service.pump();
        break;
      case "gone":
        this.#finish();
        break;
    }
  }

  async #answer(call: ServiceCall): Promise<void> {
    let value: unknown;
    try {
      value = await this.service.as(this.number, () => this.#answers.answer(call));
    } catch (error) {
      if (!this.#isOver) this.core.fail(this.number, call.id, error);
      return this.pump();
    }
    // A value that does not fit is this side's mistake: whoever wrote it should see it, too.
    if (!this.#isOver) callSafely(() => this.core.reply(this.number, call.id, value));
    this.pump();
  }

  #connectPipe({ id, object, member, index }: ServiceEvent & { kind: "pipe_connected" }): void {
    const pipe = object.pipe(member);
    const endpoint = new ServedEndpoint(this.service, pipe, this.number, id, index);
    this.#pipes.set(id, endpoint);
    pipe.endpoints.add(endpoint);
    try {
      const handler = object.implementation[member];
      if (typeof handler === "function") {
        const handled: unknown = this.service.as(this.number, () =>
          (handler as (endpoint: ServedEndpoint) => unknown).call(object.implementation, endpoint),
        );
        void Promise.resolve(handled).catch(report);
      }
      this.core.acceptPipe(this.number, id);
    } catch (error) {
      this.core.refusePipe(this.number, id, error);
      endpoint.closed();
      this.#pipes.delete(id);
    }
  }

  #finish(): void {
    if (this.#isOver) return;
    this.#isOver = true;
    this.#timer.stop();
    this.transport.close();
    this.#answers.endAll();
    for (const pipe of this.#pipes.values()) pipe.closed();
    const gone = makeError("ConnectionError", "the client is gone");
    for (const { reject } of this.#callbacks.values()) reject(gone);
    for (const resolve of this.#senders.splice(0)) resolve();
    this.core.forget(this.number);
    this.service.forget(this);
  }

  /** An exception here is a trap in the core, or a broken transport. */
  #guarded(what: () => void): void {
    try {
      what();
    } catch (error) {
      report(makeError("InternalError", `a client of the page was lost: ${textOf(error)}`));
      this.#finish();
    }
  }
}
