// The stop of a board: always in reach, sent at once by press or key, and what became of it is said.
// Layer: web/board.

import { useEffect, useRef, useState } from "preact/hooks";
import { t } from "../app/language";
import { tellStop } from "../robot/control";
import { explain } from "../robot/remote";
import type { Remote } from "../robot/remote";
import { stopDevice } from "../robot/stop";
import type { StopCall } from "../robot/stop";
import { clockTime } from "../ui/words";

type State =
  | { kind: "ready" }
  | { kind: "sent"; at: number }
  | { kind: "arrived"; tookMs: number; time: number }
  | { kind: "failed"; why: string };

export function StopButton({ object, stop }: { object: Remote | null; stop: StopCall }) {
  const [state, setState] = useState<State>({ kind: "ready" });
  const latest = useRef(object);
  latest.current = object;
  const send = (): void => {
    const at = performance.now();
    const device = latest.current;
    if (!device) {
      tellStop();
      return setState({ kind: "failed", why: t("not connected: nothing was sent") });
    }
    setState({ kind: "sent", at }); // each press sends again
    const fail = (error: unknown): void => setState({ kind: "failed", why: explain(error) });
    stopDevice(device, stop, fail).then(
      () => setState({ kind: "arrived", tookMs: performance.now() - at, time: Date.now() }),
      fail,
    );
  };
  const sendNow = useRef(send);
  sendNow.current = send;
  useEffect(() => {
    const heard = (event: KeyboardEvent): void => {
      if (event.code !== "Escape" || event.repeat) return;
      sendNow.current();
    };
    window.addEventListener("keydown", heard, { capture: true });
    return () => window.removeEventListener("keydown", heard, { capture: true });
  }, []);
  return (
    <div class="stop">
      {/* At the press already; a click alone is the keyboard's, or a screen reader's. */}
      <button
        class="stop-button"
        type="button"
        onPointerDown={(event) => event.button === 0 && send()}
        onClick={(event) => event.detail === 0 && send()}
      >
        {t("Stop")}
      </button>
      <p class={`stop-words ${state.kind === "failed" ? "is-bad" : ""}`} role="status" data-stop={state.kind}>
        {wordsOf(state, stop)}
      </p>
    </div>
  );
}

function wordsOf(state: State, stop: StopCall): string {
  switch (state.kind) {
    case "ready":
      return t("calls {0}; Esc, too", `${stop.call}(${stop.args.join(", ")})`);
    case "sent":
      return t("sent, no answer yet");
    case "arrived":
      return t("arrived after {0} ms, {1}", state.tookMs.toFixed(0), clockTime(state.time));
    case "failed":
      return t("NOT STOPPED: {0}", state.why);
  }
}
