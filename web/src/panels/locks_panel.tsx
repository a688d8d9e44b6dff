// Keeps others from changing an object while one works on it, and shows who has its leases and locks.
// Layer: web/panels. Source: sessions spec, object locks.

import { t } from "../app/language";
import { useStore } from "../app/store";
import { isUsb } from "../gateway/usb_devices";
import { endOfLease, nameOfHolder, useHolders } from "../live/holders";
import type { Holder } from "../live/holders";
import { useAction } from "../members/row";
import { OwnLocks } from "../robot/own_locks";
import { Failure } from "../ui/failure";
import { clockTime } from "../ui/words";
import type { PanelProps } from "./panel";

const none = new OwnLocks();

export default function LocksPanel({ object, place }: PanelProps) {
  const held = useStore((object?.locks ?? none).state);
  const since = held.get(object?.path ?? "")?.since ?? null;
  const asking = useAction();
  const take = (kind: "user" | "client"): void => asking.run(async () => object?.lock(kind));
  const giveBack = (): void => asking.run(async () => object?.unlock());
  const off = !object || asking.busy;
  return (
    <div class="locks-panel">
      <p role="status">
        {since === null ? t("Not locked by this page.") : t("Locked by this page since {0}.", clockTime(since))}
      </p>
      <div class="row-line">
        {since !== null ? (
          <button class="button" type="button" disabled={off} onClick={giveBack}>
            {t("Unlock")}
          </button>
        ) : (
          <>
            <button class="button" type="button" disabled={off} onClick={() => take("user")}>
              {t("Lock for this user")}
            </button>
            <button class="button" type="button" disabled={off} onClick={() => take("client")}>
              {t("Lock for this page")}
            </button>
          </>
        )}
      </div>
      <Failure text={asking.failure} />
      {!isUsb(place.device) && <HoldersList place={place} />}
    </div>
  );
}

function HoldersList({ place }: Pick<PanelProps, "place">) {
  const { found, failure } = useHolders(place);
  if (!found)
    return (
      <p class="note">
        {failure === null
          ? t("Asking the gateway who has leases and locks.")
          : t("The gateway does not tell who has leases and locks: {0}", failure)}
      </p>
    );
  if (found.length === 0)
    return (
      <p class="note">{t("The gateway knows of no lease or lock of it. Those of relayed devices pass it unseen.")}</p>
    );
  return (
    <ul class="holders" aria-label={t("Leases and locks")}>
      {found.map((holder, i) => (
        <li key={i}>{wordsOf(holder)}</li>
      ))}
    </ul>
  );
}

function wordsOf(holder: Holder): string {
  const { what, path } = holder;
  const who = nameOfHolder(holder);
  switch (what) {
    case "lease":
      return t("{0}: {1} has the lease, {2}", path, who, endOfLease(holder));
    case "user":
      return t("{0}: locked for all clients of {1}", path, who);
    case "client":
      return t("{0}: locked for one client of {1}", path, who);
    case "monitor":
      return t("{0}: a monitor lock of {1}", path, who);
  }
}
