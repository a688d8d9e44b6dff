// Who commands: taken, given back, lost. Layer: web/ui.

import { useEffect, useMemo, useRef } from "preact/hooks";
import { t } from "../app/language";
import type { Place } from "../app/router";
import { Store, useStore } from "../app/store";
import { isUsb } from "../gateway/usb_devices";
import { endOfLease, nameOfHolder, useHolders } from "../live/holders";
import { controlOf } from "../robot/control";
import type { Control, ControlState } from "../robot/control";
import type { Remote } from "../robot/remote";
import { clockTime } from "./words";

export interface InControl {
  control: Control | null;
  /** The same; without a connection the last one, for what became of it. */
  last: Control | null;
  /** False after it was lost, until it is taken by hand, and while the gateway does not confirm it. */
  isOpen: boolean;
}

const NOBODY = new Store<ControlState>({ kind: "idle" });

export function useControl(object: Remote | null): InControl {
  const control = useMemo(() => (object ? controlOf(object) : null), [object]);
  const last = useRef(control);
  last.current = control ?? last.current;
  useEffect(() => control?.use(), [control]);
  const kind = useControlKind(last.current);
  return { control, last: last.current, isOpen: control !== null && kind !== "lost" && kind !== "doubtful" };
}

export function useControlKind(control: Control | null): ControlState["kind"] {
  return useStore(control?.state ?? NOBODY).kind;
}

export interface ControlLineProps {
  control: Control | null;
  /** Whether there is a device to command. */
  isThere: boolean;
  /** What is commanded: who else has it is shown. */
  place: Place;
  /** No command takes it by itself. */
  byHand?: boolean;
}

export function ControlLine({ control, isThere, place, byHand = false }: ControlLineProps) {
  const state = useStore(control?.state ?? NOBODY);
  if (state.kind === "free") return <p class="control-line note">{t("Nobody gives leases of it: all may command.")}</p>;
  const take = (takeover: boolean): void => void control?.take(takeover).catch(() => undefined); // the state says why not
  return (
    <div class="control-line" data-control={state.kind}>
      {state.kind === "held" || state.kind === "doubtful" ? (
        <button class="button" type="button" onClick={() => void control?.release().catch(() => undefined)}>
          {t("Give back")}
        </button>
      ) : (
        <button
          class="button"
          type="button"
          disabled={!control || !isThere || state.kind === "taking"}
          onClick={() => take(state.kind === "lost" && state.byOthers)}
        >
          {state.kind === "lost" && state.byOthers ? t("Take over") : t("Take control")}
        </button>
      )}
      {isThere && !isUsb(place.device) && (state.kind === "idle" || state.kind === "lost") && (
        <OtherHolder place={place} />
      )}
      <p role="status" class={"reason" in state ? "failure" : "note"}>
        {state.kind === "held"
          ? t("You are in control since {0}.", clockTime(state.since))
          : "reason" in state
            ? state.reason
            : byHand
              ? ""
              : t("Your first command takes control.")}
      </p>
    </div>
  );
}

/** Who has the lease of it now, and for how long; nothing where it is free. */
function OtherHolder({ place }: { place: Place }) {
  const lease = useHolders(place).found?.find(({ what }) => what === "lease");
  if (!lease) return null;
  const shown = lease.leftMs !== null && lease.deadmanMs > 0;
  return (
    <p class="holder" data-holder={lease.user}>
      {shown && <meter max={lease.deadmanMs} value={lease.leftMs ?? 0} aria-label={t("Time left")} />}{" "}
      {t("{0} is in control, {1}", nameOfHolder(lease), endOfLease(lease))}
    </p>
  );
}
