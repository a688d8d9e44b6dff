// The right to command an object, held for as long as this page is alive and looked at. Layer: wasm-client/ts.
// Renewed by a timer of this thread: a page that is frozen, hidden, offline or gone renews nothing, and the gateway makes
// the device safe.
import { callSafely, ErrorCode, makeError, RobotRaconteurError } from "../errors.js";
import { Info } from "../object.js";
import type { Session } from "../session.js";
import type { CallOptions, Lease, LeaseOptions, RemoteObject } from "../types.js";

const Command = { acquire: 0, takeOver: 1, renew: 2, release: 3 } as const;
const renewalsPerDeadman = 3;
const defaultDeadman = 1000;
const defaultCallTimeout = 2000;

/** See lease() of the package. */
export async function lease(object: RemoteObject, options: LeaseOptions = {}): Promise<Lease> {
  const deadman = options.deadman ?? defaultDeadman;
  if (!(deadman >= 50 && deadman <= 60_000)) {
    throw makeError("InvalidArgument", `deadman ${String(deadman)}: expected 50 to 60000 ms`);
  }
  if (isHidden()) throw makeError("InvalidOperation", "this page is hidden: it can hold no lease");
  const session = Info.sessionOf(object);
  const path = object.$.path;
  const ask = (command: number, more: CallOptions = {}) =>
    session.request((core) => core.lease(path, command, deadman), more);
  try {
    await ask(options.takeover ? Command.takeOver : Command.acquire, options);
  } catch (error) {
    throw explain(error);
  }
  const held = new HeldLease(ask, deadman);
  held.whenOver(limitCalls(session, path, options.callTimeout ?? defaultCallTimeout));
  held.whenOver(
    session.onClose((reason) => held.lose(reason ?? makeError("ConnectionError", "the session was closed"))),
  );
  return held;
}

const limits = new WeakMap<Session, Map<string, number>>();

/** Calls of the object and of those below it have so much time, until the returned function is called. */
function limitCalls(session: Session, path: string, timeout: number): () => void {
  const ofSession = limits.get(session) ?? new Map<string, number>();
  limits.set(session, ofSession);
  ofSession.set(path, timeout);
  session.timeoutAt = (asked) => [...ofSession].find(([held]) => asked === held || asked.startsWith(`${held}.`))?.[1];
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
  #isHeld = true;
  #isRenewing = false;
  #isReleased = false;
  readonly #losers = new Set<(reason: RobotRaconteurError) => void>();
  readonly #undo: (() => void)[] = [];

  constructor(
    private readonly ask: (command: number, options?: CallOptions) => Promise<unknown>,
    deadman: number,
  ) {
    this.ended = new Promise((resolve) => (this.#end = resolve));
    const timer = setInterval(() => void this.#renew(deadman), deadman / renewalsPerDeadman);
    this.whenOver(() => clearInterval(timer));
  }

  get isHeld(): boolean {
    return this.#isHeld;
  }

  whenOver(undo: () => void): void {
    this.#undo.push(undo);
  }

  onLost(lost: (reason: RobotRaconteurError) => void): () => void {
    this.#losers.add(lost);
    return () => void this.#losers.delete(lost);
  }

  async release(): Promise<void> {
    if (this.#isReleased) return;
    this.#isReleased = true;
    if (this.#isHeld) this.#finish();
    await this.ask(Command.release); // of one that was lost, too: until then its commands are refused
  }

  [Symbol.asyncDispose](): Promise<void> {
    return this.release();
  }

  lose(reason: RobotRaconteurError): void {
    if (!this.#isHeld) return;
    const losers = [...this.#losers];
    this.#finish(reason);
    for (const lost of losers) callSafely(() => lost(reason));
  }

  /** One at a time: those that a slow line delays say nothing of a page that is alive later. */
  async #renew(deadman: number): Promise<void> {
    if (this.#isRenewing || isHidden()) return;
    this.#isRenewing = true;
    try {
      await this.ask(Command.renew, { timeout: deadman });
    } catch (error) {
      // Unanswered: the gateway knows. The next renewal asks it.
      const isLate = error instanceof RobotRaconteurError && error.code === ErrorCode.RequestTimeout;
      if (!isLate) this.lose(error as RobotRaconteurError);
    } finally {
      this.#isRenewing = false;
    }
  }

  #finish(reason?: RobotRaconteurError): void {
    this.#isHeld = false;
    for (const undo of this.#undo.splice(0)) undo();
    this.#losers.clear();
    this.#end(reason);
  }
}
