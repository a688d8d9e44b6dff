// The right of this page to command an object: taken with the first command, kept for as long as the page is alive and
// looked at, and given back with a button. Layer: web/robot.
// Where no gateway gives leases, commands need none. Who has lost it takes it again by hand: a key that is still held down
// must not go on by itself, and a device that comes back is commanded by nobody yet.

import { ErrorCode, RobotRaconteurError } from "rrgate-client";
import type { Lease } from "rrgate-client";
import { t } from "../app/language";
import { Store } from "../app/store";
import { explain } from "./remote";
import type { Remote } from "./remote";

export type ControlState =
  | { kind: "idle" }
  | { kind: "taking" }
  | { kind: "held"; since: number }
  /** The gateway has answered no renewal in time: it may have made the device safe. Ends as held or lost. */
  | { kind: "doubtful"; reason: string }
  /** Nobody gives leases of this object. */
  | { kind: "free" }
  | { kind: "lost"; reason: string; byOthers: boolean };

/** Without a renewal for so long the gateway makes the device safe; renewed three times as often. */
const DEADMAN_MS = 1000;

export class Control {
  readonly state: Store<ControlState>;
  readonly #object: Pick<Remote, "lease">;
  #lease: Lease | null = null;
  #users = 0;
  #taking: Promise<void> | null = null;
  /** What is granted from now on is wanted no more. */
  #isLeft = false;
  #isUnguarded: boolean;

  /** `before`: of the same object over the connection before; what was lost there is lost here. */
  constructor(object: Pick<Remote, "lease">, before?: Control) {
    this.#object = object;
    const was = before?.state.value;
    this.state = new Store<ControlState>(was?.kind === "lost" ? was : { kind: "idle" });
    this.#isUnguarded = before?.isUnguarded ?? false;
  }

  get mayCommand(): boolean {
    return this.state.value.kind === "held" || this.state.value.kind === "free";
  }

  /** Whether its commands needed no lease, perhaps over a connection before: nobody makes safe what they did. */
  get isUnguarded(): boolean {
    return this.#isUnguarded;
  }

  /** For a first command. @throws (rejects) where others have it, and where it was lost. */
  async begin(): Promise<void> {
    const { value } = this.state;
    if (value.kind === "lost" || value.kind === "doubtful") throw new Error(value.reason);
    if (!this.mayCommand) await this.take();
  }

  /** By hand. `takeover`: from whoever has it. @throws (rejects) with why not, which the state says, too. */
  async take(takeover = false): Promise<void> {
    this.#taking ??= this.#ask(takeover).finally(() => (this.#taking = null));
    return this.#taking;
  }

  /** Until all who use it have called the function that is returned: it is given back then. */
  use(): () => void {
    this.#users += 1;
    this.#isLeft = false;
    return () => {
      this.#users -= 1;
      this.#isLeft = this.#users === 0;
      if (this.#isLeft && this.#lease) this.release().catch(() => undefined); // ends with its session, too
    };
  }

  /** The connection or the device is gone, and with it what was held. */
  end(reason: string): void {
    this.#isLeft = true;
    this.giveUp(new Error(reason));
  }

  /** What is held is lost, and given back, so that the gateway makes the device safe: no right and no rate refuses that. */
  giveUp(reason: unknown): void {
    const lease = this.#lease;
    if (!lease) return;
    this.#lose(reason);
    lease.release().catch(() => undefined); // ends with its session, too
  }

  async release(): Promise<void> {
    const lease = this.#lease;
    this.#lease = null;
    this.state.value = { kind: "idle" };
    await lease?.release();
  }

  async #ask(takeover: boolean): Promise<void> {
    this.state.value = { kind: "taking" };
    let lease: Lease;
    try {
      lease = await this.#object.lease({ deadman: DEADMAN_MS, takeover, timeout: 2_000 });
    } catch (error) {
      if (codeOf(error) !== ErrorCode.NotImplementedError) {
        this.#lose(error);
        throw error;
      }
      this.state.value = { kind: "free" };
      this.#isUnguarded = true;
      return;
    }
    if (this.#isLeft) {
      this.state.value = { kind: "idle" }; // nobody would see that it is held
      lease.release().catch(() => undefined);
      throw new Error(t("not connected: nothing was sent"));
    }
    this.#hold(lease);
  }

  #hold(lease: Lease): void {
    const since = Date.now();
    this.#lease = lease;
    this.#isUnguarded = false;
    this.state.value = { kind: "held", since };
    lease.onState((state, reason) => {
      if (lease !== this.#lease) return;
      if (state === "held") this.state.value = { kind: "held", since };
      if (state === "doubtful") this.state.value = { kind: "doubtful", reason: doubt(reason) };
    });
    lease.onLost((reason) => lease === this.#lease && this.#lose(reason));
  }

  #lose(reason: unknown): void {
    this.#lease = null;
    const byOthers = isLocked(reason) || /taken over/.test(explain(reason));
    this.state.value = { kind: "lost", reason: t("You are not in control: {0}", explain(reason)), byOthers };
  }
}

const doubt = (reason: unknown): string => t("You may not be in control any more: {0}", explain(reason));

/** Whether a command was refused because its sender does not have the right to command, or another has it. */
export const isLocked = (error: unknown): boolean => codeOf(error) === ErrorCode.ObjectLockedError;

/** Whether nothing came back from the device: by a connection that broke unnoticed, or to a gateway that has none to it. */
export const isUnanswered = (error: unknown): boolean =>
  codeOf(error) === ErrorCode.RequestTimeout || codeOf(error) === ErrorCode.ConnectionError;

function codeOf(error: unknown): number | undefined {
  return error instanceof RobotRaconteurError ? error.code : undefined;
}

const controls = new WeakMap<Remote, Control>();

/** One for all panels that show the object; one anew for each connection. */
export function controlOf(object: Remote): Control {
  const found = controls.get(object);
  if (found) return found;
  const control = new Control(object, object.controls.get(object.path));
  controls.set(object, control);
  object.controls.set(object.path, control);
  return control;
}

/**
 * A stop that is refused because of a lock that this page had, and lost while the device was away, gives that up and is sent again.
 * A stop that is refused because somebody else has the lease: what this page commanded has been made safe by the gateway when
 * the lease went; where nobody gives leases, nothing has been made safe. Who `insists` takes it over, where one may, or takes it
 * where nobody has it any more, so that the gateway makes the device safe once more, and leaves it free.
 * Where a stop fails otherwise, as for rights or rates, this page loses its lease, and the gateway makes the device safe; where
 * the gateway does not confirm the lease, it does so by itself.
 * @throws (rejects) with what `stop` failed with.
 */
export async function stopNow(
  object: Pick<Remote, "lease" | "locks" | "path" | "controls">,
  insists: boolean,
  stop: () => Promise<unknown>,
): Promise<void> {
  try {
    await stop();
  } catch (error) {
    const control = object.controls.get(object.path);
    if (!isLocked(error)) {
      if (control?.state.value.kind === "held") control.giveUp(error);
      throw error;
    }
    if (await object.locks.giveUp(object.path)) return stopNow(object, insists, stop);
    if (!insists) {
      if (control?.isUnguarded) throw error;
      return;
    }
    const timeout = 2_000;
    const lease = await object
      .lease({ takeover: true, timeout })
      .catch((why: unknown) =>
        codeOf(why) === ErrorCode.PermissionDenied ? object.lease({ timeout }) : Promise.reject(error),
      )
      .catch(() => Promise.reject(error));
    await lease.release();
  }
}

/** By what it means, and by its place: either may be another on a keyboard whose keys were given other meanings. */
export function isEscape({ key, code }: Pick<KeyboardEvent, "key" | "code">): boolean {
  return key === "Escape" || code === "Escape";
}

const stopping = new EventTarget();
let stops = 0;

/** Somebody asked for a stop: whatever is held down drives no more. */
export function tellStop(): void {
  stops += 1;
  stopping.dispatchEvent(new Event("stop"));
}

/** @returns whether somebody has asked for a stop since: what is done in several steps ends there. */
export function watchStop(): () => boolean {
  const before = stops;
  return () => stops !== before;
}

/** @returns a function that hears no more. */
export function onStop(heard: () => void): () => void {
  stopping.addEventListener("stop", heard);
  return () => stopping.removeEventListener("stop", heard);
}
