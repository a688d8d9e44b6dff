// Keeps others from changing an object while one works on it.
// Layer: web/panels. Source: sessions spec, object locks.

import { t } from "../app/language";
import { Store, useStore } from "../app/store";
import { useAction } from "../members/row";
import type { Remote } from "../robot/remote";
import { Failure } from "../ui/failure";
import { clockTime } from "../ui/words";
import type { PanelProps } from "./panel";

/** When this page has locked the object; null: it has not. */
type Held = Store<number | null>;

const ofObjects = new WeakMap<Remote, Held>();
const none: Held = new Store<number | null>(null);

/** The lock belongs to the session, whatever panel shows it, and ends with it. */
function heldOf(object: Remote): Held {
  const found = ofObjects.get(object) ?? new Store<number | null>(null);
  ofObjects.set(object, found);
  return found;
}

export default function LocksPanel({ object }: PanelProps) {
  const lock = object ? heldOf(object) : none;
  const since = useStore(lock);
  const asking = useAction();
  const take = (kind: "user" | "client"): void =>
    asking.run(async () => {
      await object?.lock(kind);
      lock.value = Date.now();
    });
  const giveBack = (): void =>
    asking.run(async () => {
      await object?.unlock();
      lock.value = null;
    });
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
    </div>
  );
}
