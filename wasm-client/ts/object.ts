// Objects of a service, built from the definition that the service sent. Layer: wasm-client/ts.
import { asyncDispose } from "./dispose.js";
import { callSafely, makeError } from "./errors.js";
import type { RobotRaconteurError } from "./errors.js";
import { makeCallback } from "./members/callback.js";
import { makeEvent } from "./members/event.js";
import { makeFunction } from "./members/function.js";
import type { MemberContext } from "./members/member.js";
import { makeMemory } from "./members/memory.js";
import { makeObjref } from "./members/objref.js";
import { makePipe } from "./members/pipe.js";
import { makeProperty } from "./members/property.js";
import { makeWire } from "./members/wire.js";
import { checkTimeout, isWithin, releasedObject } from "./session.js";
import type { Session } from "./session.js";
import { noStats } from "./wasm_module.js";
import { checkSignal, within } from "./within.js";
import type {
  CallOptions,
  DefinitionInfo,
  DynamicMember,
  Lease,
  LeaseOptions,
  MemberInfo,
  MemberKind,
  ObjectInfo,
  ObjectState,
  RemoteObject,
  RrValue,
  SessionStats,
} from "./types.js";

/** One row a kind of member. */
const faces: Record<MemberKind, (context: MemberContext) => unknown> = {
  property: makeProperty,
  function: makeFunction,
  event: makeEvent,
  objref: makeObjref,
  wire: makeWire,
  pipe: makePipe,
  callback: makeCallback,
  memory: makeMemory,
};

/**
 * Names that JavaScript calls by itself: `await robot` would call a function `then`, text conversion a `toString`.
 * Such members are reached by `robot.$.member(name)`.
 */
const implicitNames = new Set(["then", "toString", "toJSON", "valueOf"]);

/** What is known at a path until the service releases it. */
interface Known {
  /** A look-up that all may wait for. */
  shared?: Promise<RemoteObject>;
  object?: RemoteObject;
  /** Tells all objects that were made of it. */
  readonly released: (() => void)[];
}

/** The objects of one session, by path. */
export class ObjectTree {
  readonly #objects = new Map<string, Known>();
  readonly #session: Session;

  constructor(session: Session) {
    this.#session = session;
    session.onRelease((path) => this.#release(path));
  }

  root(path: string, type: string): RemoteObject {
    const known = this.#knownAt(path);
    known.object = this.#build(path, type, known.released, true);
    known.shared = Promise.resolve(known.object);
    return known.object;
  }

  find(path: string, options: CallOptions = {}): Promise<RemoteObject> {
    // A look-up with limits of its own shares nothing: its end must not be that of others.
    // Nor does one that comes too late: the request says why.
    const isShared = !options.signal && options.timeout === undefined && !this.#session.isClosed;
    const before = this.#objects.get(path)?.shared;
    if (before && isShared) return before;
    let found: RemoteObject;
    const ask = this.#session.request(
      (core) => core.findObject(path),
      options,
      (type) => (found = this.#take(path, type as string)), // at once: its release may follow in the same message
    );
    const object = ask.then(() => found);
    if (!isShared) return object;
    const known = this.#knownAt(path);
    known.shared = object;
    object.catch(() => {
      delete known.shared;
      if (!known.object && this.#objects.get(path) === known) this.#objects.delete(path);
    });
    return object;
  }

  #knownAt(path: string): Known {
    const known = this.#objects.get(path) ?? { released: [] };
    this.#objects.set(path, known);
    return known;
  }

  /** The object that was found there before, where it is still of this type. */
  #take(path: string, type: string): RemoteObject {
    const known = this.#knownAt(path);
    if (known.object?.$.type !== type) known.object = this.#build(path, type, known.released);
    return known.object;
  }

  #release(path: string): void {
    for (const [known, { released }] of [...this.#objects]) {
      if (!isWithin(known, path)) continue;
      this.#objects.delete(known);
      for (const tell of released.splice(0)) tell();
    }
  }

  #build(path: string, type: string, released: (() => void)[], isRoot = false): RemoteObject {
    const session = this.#session;
    const members = (session.look((core) => core.members(path)) ?? []).map(freezeInfo);
    const handles = new Map<string, DynamicMember>();
    for (const info of members) {
      const context: MemberContext = {
        session,
        path,
        info,
        isReleased: () => !this.#objects.get(path)?.object,
        findObject: (child, options) => this.find(child, options),
      };
      handles.set(info.name, faces[info.kind](context) as DynamicMember);
    }
    // No prototype: what is not a member of the service is not there at all.
    const object = Object.create(null) as object;
    for (const [name, handle] of handles) {
      if (!implicitNames.has(name)) Object.defineProperty(object, name, { value: handle, enumerable: true });
    }
    Object.defineProperty(object, "$", { value: new Info(this, session, type, path, members, handles, released) });
    Object.defineProperty(object, Symbol.toStringTag, { value: type });
    if (isRoot) Object.defineProperty(object, asyncDispose, { value: () => session.close() });
    return Object.freeze(object) as RemoteObject;
  }
}

/**
 * Holds the right to command `object` and all below it at a gateway that gives leases of it.
 * @throws RobotRaconteurError (rejects) ObjectLockedError: somebody else has it; NotImplementedError: there are none;
 * InvalidOperation: this page is hidden; PermissionDenied; InvalidArgument
 */
export const lease = async (object: { readonly $: ObjectInfo }, options?: LeaseOptions): Promise<Lease> =>
  (await import("./lease/held_lease.js")).lease(object, options);

/** What stands behind `$`; not for users of the package. */
export class Info implements ObjectInfo {
  #isReleased = false;
  readonly #tree: ObjectTree;
  readonly #session: Session;
  readonly #handles: ReadonlyMap<string, DynamicMember>;
  readonly #closers = new Set<(reason?: RobotRaconteurError) => void>();
  readonly #attributes: Map<string, RrValue>;
  readonly #node: { id: string; name: string };
  #stats: SessionStats = noStats;
  #types: string[] = [];

  constructor(
    tree: ObjectTree,
    session: Session,
    readonly type: string,
    readonly path: string,
    readonly members: readonly MemberInfo[],
    handles: ReadonlyMap<string, DynamicMember>,
    released: (() => void)[],
  ) {
    this.#tree = tree;
    this.#session = session;
    this.#handles = handles;
    this.#attributes = session.look((core) => core.attributes()) ?? new Map<string, RrValue>();
    this.#node = session.look((core) => core.peer()) ?? { id: "", name: "" };
    released.push(() => this.#release());
  }

  static sessionOf(object: { readonly $: ObjectInfo }): Session {
    return (object.$ as Info).#session;
  }

  get urgent(): ObjectInfo["urgent"] {
    type Command = (...args: unknown[]) => Promise<RrValue | undefined>;
    const functions = Object.create(null) as Record<string, Command>;
    for (const [name, handle] of this.#handles) {
      const { set, poke } = handle as Partial<DynamicMember>;
      const command = (typeof handle === "function" ? handle : (set ?? poke)) as Command | undefined;
      if (command) functions[name] = (...args) => this.#session.urgently(() => command(...args));
    }
    return functions;
  }

  get state(): ObjectState {
    if (this.#session.isClosed) return "closed";
    return this.#isReleased ? "released" : "connected";
  }

  get attributes(): ReadonlyMap<string, RrValue> {
    return this.#attributes;
  }

  get node(): { readonly id: string; readonly name: string } {
    return this.#node;
  }

  get types(): readonly string[] {
    return (this.#types = this.#session.look((core) => core.definitions()) ?? this.#types);
  }

  get constants(): ObjectInfo["constants"] {
    return import("./definition/definition.js").then(({ constants }) => constants(this.#session, this.type));
  }

  async definition(name?: string): Promise<DefinitionInfo> {
    return (await import("./definition/definition.js")).definition(this.#session, this.type, name);
  }

  get stats(): SessionStats {
    return (this.#stats = this.#session.look((core) => core.stats()) ?? this.#stats);
  }

  member(name: string): DynamicMember {
    const handle = this.#handles.get(name);
    if (!handle) throw makeError("MemberNotFound", `${this.type} has no member "${name}"`);
    return handle;
  }

  find(path: string, options: CallOptions = {}): Promise<RemoteObject> {
    const service = this.path.split(".", 1)[0]!;
    return this.#tree.find(
      path.replace(/^\*(?=\.|$)/, () => service),
      options,
    );
  }

  async login(
    username: string,
    credentials: string | Record<string, unknown> | ReadonlyMap<string, unknown>,
    options: CallOptions = {},
  ): Promise<void> {
    const given = typeof credentials === "string" ? { password: credentials } : credentials;
    await this.#session.request((core) => core.authenticate(username, given), options);
  }

  async logout(options: CallOptions = {}): Promise<void> {
    await this.#session.request((core) => core.logout(), options);
  }

  async lock(kind: "user" | "client" = "user", options: CallOptions = {}): Promise<void> {
    if (kind !== "user" && kind !== "client") {
      throw makeError("InvalidArgument", `lock: found "${String(kind)}", expected "user" or "client"`);
    }
    await this.#session.request((core) => core.lock(this.path, kind), options);
  }

  async unlock(options: CallOptions = {}): Promise<void> {
    await this.#session.request((core) => core.unlock(this.path), options);
  }

  async monitor<R>(action: () => R | Promise<R>, { signal, timeout }: CallOptions = {}): Promise<R> {
    const session = this.#session;
    if (typeof action !== "function") {
      throw makeError("InvalidArgument", `monitor: found ${typeof action}, expected a function`);
    }
    checkSignal(signal);
    if (timeout !== undefined) checkTimeout(timeout);
    const entering = session.request((core) => core.enterMonitor(this.path, timeout ?? -1));
    const leave = () => session.request((core) => core.exitMonitor(this.path));
    try {
      await within(entering, { signal }, "");
    } catch (error) {
      // Who gave up may get the monitor later, and must not keep it.
      void entering.then(leave).catch(() => undefined);
      throw error;
    }
    let result: R;
    try {
      result = await action();
    } catch (error) {
      await leave().catch(() => undefined); // the first error is the one to tell
      throw error;
    }
    await leave();
    return result;
  }

  close(): Promise<void> {
    return this.#session.close();
  }

  onClose(closed: (reason?: RobotRaconteurError) => void): () => void {
    const stop = this.#session.onClose((reason) => {
      this.#closers.delete(closer);
      if (reason) closed(reason);
      else closed();
    });
    const closer = (reason?: RobotRaconteurError) => {
      stop();
      closed(reason);
    };
    this.#closers.add(closer);
    return () => {
      this.#closers.delete(closer);
      stop();
    };
  }

  #release(): void {
    this.#isReleased = true;
    const closers = [...this.#closers];
    this.#closers.clear();
    const reason = releasedObject(this.path);
    for (const closed of closers) callSafely(() => closed(reason));
  }
}

export function freezeInfo(info: MemberInfo): MemberInfo {
  info.parameters.forEach((parameter) => Object.freeze(parameter));
  Object.freeze(info.parameters);
  Object.freeze(info.modifiers);
  // The text stands right behind its "##"; the customary blank there is not meant.
  return Object.freeze({ ...info, documentation: info.documentation.replace(/^ /gm, "").trim() });
}
