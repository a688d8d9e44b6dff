// An object of a page that is a device: what its author gave, and the members that are his to drive. Layer:
// wasm-client/ts.
import { makeError } from "../errors.js";
import { queueLimits, ValueQueue } from "../members/queue.js";
import type { MemberInfo, RrValue } from "../types.js";

/** What may wait of an endpoint's packets. */
const { limit, maxBytes } = queueLimits;

/** What an object asks of the service that it belongs to. */
export interface ServiceOfObject {
  emit(object: ServedObject, event: string, args: readonly unknown[]): void;
  setWire(object: ServedObject, wire: string, value: unknown): void;
  sendPipe(endpoint: ServedEndpoint, value: unknown): Promise<void>;
  closePipe(endpoint: ServedEndpoint): void;
  callBack(client: number, object: ServedObject, callback: string, args: readonly unknown[]): Promise<RrValue>;
  release(parent: ServedObject, objref: string, index: string | number | undefined): void;
}

/** The members of an implementation, by their names. */
export type Implementation = Record<string, unknown>;

export class ServedObject {
  /** Values of wires, by their names: what clients hear, and what they sent last. */
  readonly inValues = new Map<string, unknown>();
  readonly outValues = new Map<string, RrValue>();
  readonly #pipes = new Map<string, ServedPipe>();

  constructor(
    private readonly service: ServiceOfObject,
    /** "Phone", "Phone.camera". */
    readonly path: string,
    /** Of the object, qualified. */
    readonly type: string,
    readonly implementation: Implementation,
    readonly members: ReadonlyMap<string, MemberInfo>,
  ) {}

  /** Tells all clients. @throws RobotRaconteurError: there is no such event, or the arguments do not fit. */
  emit(event: string, ...args: unknown[]): void {
    this.#check(event, "event");
    this.service.emit(this, event, args);
  }

  /** What all clients of a wire have from now on. @throws RobotRaconteurError */
  setWire(wire: string, value: unknown): void {
    this.#check(wire, "wire");
    this.service.setWire(this, wire, value);
    this.inValues.set(wire, value);
  }

  /** @throws RobotRaconteurError: there is no such pipe. */
  pipe(name: string): ServedPipe {
    this.#check(name, "pipe");
    let pipe = this.#pipes.get(name);
    if (!pipe) this.#pipes.set(name, (pipe = new ServedPipe()));
    return pipe;
  }

  /**
   * The objects behind an objref, or the one behind an index of it, are others from now on: clients look them up again.
   * @throws RobotRaconteurError MemberNotFound; InvalidArgument: an index of an objref that has none
   */
  release(objref: string, index?: string | number): void {
    const { type } = this.#check(objref, "objref");
    if (index !== undefined && !/[\]}]$/.test(type))
      throw makeError("InvalidArgument", `${this.type}: objref "${objref}" has no index`);
    this.service.release(this, objref, index);
  }

  #check(name: string, kind: MemberInfo["kind"]): MemberInfo {
    const member = this.members.get(name);
    if (member?.kind === kind) return member;
    throw makeError("MemberNotFound", `${this.type} has no ${kind} "${name}"`);
  }
}

/** A pipe: the endpoints that clients have connected. */
export class ServedPipe {
  /** In the order in which they came. */
  readonly endpoints = new Set<ServedEndpoint>();

  /**
   * Sends to all endpoints. Resolves once there is room for more on the way to each of them: whoever waits for it is as
   * fast as the slowest client.
   */
  async send(value: unknown): Promise<void> {
    // One that closes meanwhile keeps nobody else waiting.
    await Promise.all([...this.endpoints].map((each) => each.send(value).catch((error) => each.unlessClosed(error))));
  }
}

/** One end of a pipe that a client has connected; what the client sends comes out of it. */
export class ServedEndpoint implements AsyncIterable<RrValue> {
  #isClosed = false;
  readonly #received: ValueQueue<RrValue>;

  constructor(
    private readonly service: ServiceOfObject,
    readonly pipe: ServedPipe,
    /** The client's number. */
    readonly client: number,
    readonly id: number,
    readonly index: number,
  ) {
    this.#received = new ValueQueue(limit, () => this.close(), undefined, maxBytes);
  }

  get isClosed(): boolean {
    return this.#isClosed;
  }

  /** Resolves once there is room for more on the way to the client. @throws RobotRaconteurError InvalidOperation: closed. */
  send(value: unknown): Promise<void> {
    return this.service.sendPipe(this, value);
  }

  close(): void {
    if (!this.#isClosed) this.service.closePipe(this);
    this.closed();
  }

  /** Packets of the client, until it closes the endpoint or goes. Of more than 10,000 or 64 MiB that wait, the oldest are lost. */
  [Symbol.asyncIterator](): AsyncIterator<RrValue, undefined> {
    return this.#received;
  }

  // --- for the service ---

  take(value: RrValue): void {
    this.#received.push(value);
  }

  closed(): void {
    this.#isClosed = true;
    this.pipe.endpoints.delete(this);
    this.#received.end();
  }

  unlessClosed(error: unknown): void {
    if (!this.#isClosed) throw error;
  }
}

/** A client, as long as a member answers it. */
export class Caller {
  constructor(
    private readonly service: ServiceOfObject,
    private readonly client: number,
  ) {}

  /** Calls a callback of the client. @throws RobotRaconteurError (rejects): what it answers; there is no answer. */
  call(object: ServedObject, callback: string, ...args: unknown[]): Promise<RrValue> {
    return this.service.callBack(this.client, object, callback, args);
  }
}
