// The right to command an object, held for as long as this page is alive and looked at. Layer: wasm-client/ts.
// Renewed by a timer of this thread: a page that is frozen, hidden, offline or gone renews nothing, and the gateway makes
// the device safe.
import { asyncDispose } from "../dispose.js";
import { callSafely, ErrorCode, makeError, RobotRaconteurError } from "../errors.js";
import { Info } from "../object.js";
import { isWithin } from "../session.js";
import type { Session } from "../session.js";
import type { CallOptions, Lease, LeaseOptions, LeaseState, ObjectInfo } from "../types.js";

const Command = { acquire: 0, takeOver: 1, renew: 2, release: 3 } as const;
const renewalsPerDeadman = 3;
const defaultDeadman = 1000;
const defaultCallTimeout = 2000;

/** See lease() of the package. */
export async function lease(object: { readonly $: ObjectInfo }, options: LeaseOptions = {}): Promise<Lease> {
  const deadman = options.deadman ?? defaultDeadman;
  if (!(deadman >= 50 && deadman <= 60_000)) {
    throw makeError("InvalidArgument", `deadman ${String(deadman)}: expected 50 to 60000 ms`);
  }
  if (isHidden()) throw makeError("InvalidOperation", "this page is hidden: it can hold no lease");
  const session = Info.sessionOf(object);
  const path = object.$.path;
  const lost = lostIn.get(session) ?? new Set<string>();
  lostIn.set(session, lost);
  const ask = (command: number, more: CallOptions = {}) => {
    if (command === Command.release) lost.delete(path);
    return session.request((core) => core.lease(path, command, deadman), more);
  };
  const askedAt = performance.now();
  const { signal } = options;
  const wasAborted = signal?.aborted;
  const asked = asking.get(session) ?? [];
  asking.set(session, asked);
  asked.push(path);
  const settled = () => asked.splice(asked.indexOf(path), 1);
  try {
    await ask(options.takeover ? Command.takeOver : Command.acquire, options);
  } catch (error) {
    settled();
    const isLate = error instanceof RobotRaconteurError && error.code === ErrorCode.RequestTimeout;
    const isGivenUp = isLate || (signal?.aborted && !wasAborted);
    // The gateway may grant it yet, and nobody would renew it. One that was lost is refused until it is released or taken
    // again: that stays so.
    if (isGivenUp && !asked.includes(path) && !limits.get(session)?.has(path) && !lost.has(path))
      void ask(Command.release).catch(() => undefined);
    throw explain(error);
  }
  const held = new HeldLease(ask, deadman, askedAt);
  held.whenOver(limitCalls(session, path, options.callTimeout ?? defaultCallTimeout));
  settled(); // not before it is among those that are held
  lost.delete(path);
  held.onLost(() => lost.add(path));
  held.whenOver(
    session.onClose((reason) => held.lose(reason ?? makeError("ConnectionError", "the session was closed"))),
  );
  return held;
}

/** The objects whose leases are asked for, once for each call. */
const asking = new WeakMap<Session, string[]>();
/** The objects whose leases were lost, and neither released nor taken again since. */
const lostIn = new WeakMap<Session, Set<string>>();
/** The objects whose leases are held. */
const limits = new WeakMap<Session, Map<string, number>>();

/** Commands of the object and of those below it have so much time, until the returned function is called. */
function limitCalls(session: Session, path: string, timeout: number): () => void {
  const ofSession = limits.get(session) ?? new Map<string, number>();
  limits.set(session, ofSession);
  ofSession.set(path, timeout);
  session.timeoutAt = (asked) => [...ofSession].find(([held]) => isWithin(asked, held))?.[1];
  return () => void ofSession.delete(path);
}

/** Services that know no leases do not say so: those with users don't know the request, others have no use for any. */
function explain(error: unknown): unknown {
  if (!(error instanceof RobotRaconteurError)) return error;
  const knowsNoUsers =
    error.code === ErrorCode.InvalidOperation && error.message.includes("authentication not activated");
  if (!knowsNoUsers && error.code !== ErrorCode.ProtocolError) return error;
  return makeError("NotImplementedError", "there is no gateway that gives leases: the device is used without one");
}

const isHidden = (): boolean => typeof document !== "undefined" && document.visibilityState === "hidden";

class HeldLease implements Lease {
  readonly ended: Promise<RobotRaconteurError | undefined>;
  #end!: (reason?: RobotRaconteurError) => void;
  #state: LeaseState = "held";
  #reason: RobotRaconteurError | undefined;
  /** When the newest renewal that was answered was asked for: the gateway's dead-man's time begins no earlier. */
  #renewedAt: number;
  #doubtTimer: ReturnType<typeof setTimeout> | undefined;
  #isRenewing = false;
  readonly #losers = new Set<(reason: RobotRaconteurError) => void>();
  readonly #watchers = new Set<(state: LeaseState, reason?: RobotRaconteurError) => void>();
  readonly #undo: (() => void)[] = [];

  /** `askedAt`  when the lease was asked for. */
  constructor(
    private readonly ask: (command: number, options?: CallOptions) => Promise<unknown>,
    private readonly deadman: number,
    askedAt: number,
  ) {
    this.#renewedAt = askedAt;
    this.ended = new Promise((resolve) => (this.#end = resolve));
    const timer = setInterval(() => void this.#renew(), deadman / renewalsPerDeadman);
    this.whenOver(() => (clearInterval(timer), clearTimeout(this.#doubtTimer)));
    this.#armDoubt();
  }

  /** By the clock: a page that has just woken up has run no timer yet. */
  get state(): LeaseState {
    this.#doubt();
    return this.#state;
  }

  get isHeld(): boolean {
    return this.state === "held";
  }

  get reason(): RobotRaconteurError | undefined {
    this.#doubt();
    return this.#reason;
  }

  whenOver(undo: () => void): void {
    this.#undo.push(undo);
  }

  onState(changed: (state: LeaseState, reason?: RobotRaconteurError) => void): () => void {
    this.#watchers.add(changed);
    return () => void this.#watchers.delete(changed);
  }

  onLost(lost: (reason: RobotRaconteurError) => void): () => void {
    this.#losers.add(lost);
    return () => void this.#losers.delete(lost);
  }

  async release(): Promise<void> {
    if (this.#state === "released") return;
    this.#finish("released");
    await this.ask(Command.release); // of one that was lost, too: until then its commands are refused
  }

  [asyncDispose](): Promise<void> {
    return this.release();
  }

  lose(reason: RobotRaconteurError): void {
    if (this.#isOver) return;
    const losers = [...this.#losers];
    this.#finish("lost", reason);
    for (const lost of losers) callSafely(() => lost(reason));
  }

  get #isOver(): boolean {
    return this.#state === "lost" || this.#state === "released";
  }

  /** One at a time: those that a slow line delays say nothing of a page that is alive later. */
  async #renew(): Promise<void> {
    if (this.#isRenewing || isHidden()) return;
    this.#isRenewing = true;
    const askedAt = performance.now();
    try {
      await this.ask(Command.renew, { timeout: this.deadman });
      if (this.#isOver) return;
      this.#renewedAt = askedAt;
      this.#show("held");
      this.#armDoubt();
    } catch (error) {
      // Unanswered: the gateway knows. The next renewal asks it.
      const isLate = error instanceof RobotRaconteurError && error.code === ErrorCode.RequestTimeout;
      if (!isLate) this.lose(error as RobotRaconteurError);
    } finally {
      this.#isRenewing = false;
    }
  }

  #doubt(): void {
    if (this.#state !== "held" || performance.now() - this.#renewedAt < this.deadman) return;
    const text = `no renewal of the lease was answered for ${this.deadman} ms: the gateway may have ended it`;
    this.#show("doubtful", makeError("RequestTimeout", text));
  }

  /** The doubt comes in time, not with the next renewal. */
  #armDoubt(): void {
    clearTimeout(this.#doubtTimer);
    this.#doubtTimer = setTimeout(() => this.#doubt(), this.#renewedAt + this.deadman - performance.now());
  }

  #show(state: LeaseState, reason?: RobotRaconteurError): void {
    if (state === this.#state) return;
    this.#state = state;
    this.#reason = reason;
    for (const changed of [...this.#watchers]) callSafely(() => changed(state, reason));
  }

  #finish(state: LeaseState, reason?: RobotRaconteurError): void {
    for (const undo of this.#undo.splice(0)) undo();
    this.#show(state, reason);
    this.#losers.clear();
    this.#watchers.clear();
    this.#end(reason);
  }
}
