// The stop of a board: always in reach, sent at once by press or key, and what became of it is said.
// Layer: web/board.

import { useEffect, useRef, useState } from "preact/hooks";
import { t } from "../app/language";
import type { DeviceList } from "../gateway/devices";
import { devicesOf, isReplay } from "../gateway/devices";
import { makeSafe, safeOf } from "../gateway/safe";
import { isSignedOut, session } from "../gateway/session";
import { isEscape, tellStop } from "../robot/control";
import { explain } from "../robot/remote";
import type { Remote } from "../robot/remote";
import { passOn, stopDevice } from "../robot/stop";
import type { StopCall } from "../robot/stop";
import { useStore } from "../app/store";
import { clockTime } from "../ui/words";

type State =
  | { kind: "ready" }
  | { kind: "sent"; at: number }
  | { kind: "arrived"; tookMs: number; time: number }
  /** By the gateway, which tells what the device has answered. */
  | { kind: "passed"; how: string }
  | { kind: "failed"; why: string };

/**
 * By a call where it is known how and there is a connection that answers, else by what the gateway does when a lease ends; nothing
 * where neither is known, and for a recording, which does not move.
 */
export function StopButton({ object, stop, place, safe }: StopButtonProps) {
  if (isReplay(place.device) || (!stop && safe.length === 0)) return null;
  const send: Send = (failed) => {
    if (stop && object) return passOn(stopDevice(object, stop, failed), (cause) => stopWithout(place, safe, cause));
    tellStop();
    return stopWithout(place, safe);
  };
  const does = stop
    ? t("calls {0}", `${stop.call}(${stop.args.join(", ")})`)
    : t("lets the gateway make it safe: {0}", safe.join(", "));
  const words = matchMedia("(any-hover: hover)").matches ? t("{0}; or press Esc", does) : does;
  return <StopPress send={send} words={words} label={t("Stop")} byEscape />;
}

/**
 * Without a connection to the device that answers: by HTTP.
 * `safe`   what the gateway does to make it safe.
 * `cause`  why it was not stopped by the connection, where there is one.
 * @returns how it went, in words. @throws (rejects) why it may not have been stopped.
 */
export async function stopWithout(
  { device, service }: StopButtonProps["place"],
  safe: readonly string[],
  cause: unknown = new Error(withSignIn(t("not connected: nothing was sent"))),
): Promise<string> {
  if (safe.length === 0) throw cause;
  const at = performance.now();
  const isAnswered = await makeSafe(device, service).catch((error: unknown) => {
    throw new Error(withSignIn(explain(error)), { cause: error });
  });
  const took = (performance.now() - at).toFixed(0);
  return isAnswered
    ? t("passed on by the gateway after {0} ms, {1}; the device has answered", took, clockTime(Date.now()))
    : t("passed on by the gateway after {0} ms, {1}; the device's answer is not known", took, clockTime(Date.now()));
}

function withSignIn(why: string): string {
  return isSignedOut(session.who.value) ? t("{0}. Sign in, then press Stop again.", why) : why;
}

export interface StopButtonProps {
  /** null: there is no connection. */
  object: Remote | null;
  stop: StopCall | null;
  place: { device: string; service: string };
  /** As useSafe() has it. */
  safe: readonly string[];
}

/**
 * What the gateway does to make a service safe; empty where it has no leases of it. Also after a sign-in has ended, and with it the
 * list of devices: a stop is still to be tried.
 */
export function useSafe({ device, service }: StopButtonProps["place"], list: DeviceList): readonly string[] {
  const devices = devicesOf(useStore(list.state));
  const place = `${device}/${service}`;
  const last = useRef<{ place: string; safe: readonly string[] }>({ place, safe: [] });
  const known = devices?.find(({ name }) => name === device);
  if (devices || last.current.place !== place) last.current = { place, safe: safeOf(known?.safe ?? [], service) };
  return last.current.safe;
}

/** `failed` hears of what fails later. With words where it was not the device that answered: how it went. */
export type Send = (failed: (error: unknown) => void) => Promise<string | void>;

export interface StopPressProps {
  send: Send;
  label: string;
  /** Before it is pressed. */
  words: string;
  byEscape?: boolean;
}

/** A button that sends at the press, and again with each, and says what became of it. */
export function StopPress({ send: stop, label, words, byEscape = false }: StopPressProps) {
  const [state, setState] = useState<State>({ kind: "ready" });
  const send = (): void => {
    const at = performance.now();
    setState({ kind: "sent", at }); // each press sends again
    const fail = (error: unknown): void => setState({ kind: "failed", why: explain(error) });
    // What was passed on stands, whatever the connection does later.
    const failLater = (error: unknown): void =>
      setState((now) => (now.kind === "passed" ? now : { kind: "failed", why: explain(error) }));
    stop(failLater).then((how) => {
      if (how !== undefined) setState({ kind: "passed", how });
      else setState({ kind: "arrived", tookMs: performance.now() - at, time: Date.now() });
    }, fail);
  };
  const sendNow = useRef(send);
  sendNow.current = send;
  useEffect(() => {
    if (!byEscape) return;
    const heard = (event: KeyboardEvent): void => {
      if (!isEscape(event) || event.repeat) return;
      sendNow.current();
    };
    window.addEventListener("keydown", heard, { capture: true });
    return () => window.removeEventListener("keydown", heard, { capture: true });
  }, [byEscape]);
  return (
    <div class="stop">
      {/* At the press already; a click alone is the keyboard's, or a screen reader's. */}
      <button
        class="stop-button"
        type="button"
        onPointerDown={(event) => event.button === 0 && send()}
        onClick={(event) => event.detail === 0 && send()}
      >
        {label}
      </button>
      <p class={`stop-words ${state.kind === "failed" ? "is-bad" : ""}`} role="status" data-stop={state.kind}>
        {wordsOf(state, words)}
      </p>
    </div>
  );
}

function wordsOf(state: State, ready: string): string {
  switch (state.kind) {
    case "ready":
      return ready;
    case "sent":
      return t("sent, no answer yet");
    case "arrived":
      return t("arrived after {0} ms, {1}", state.tookMs.toFixed(0), clockTime(state.time));
    case "passed":
      return state.how;
    case "failed":
      return t("NOT STOPPED: {0}", state.why);
  }
}
