// Keeps others from changing an object while one works on it.
// Layer: web/panels. Source: sessions spec, object locks.

import { useEffect, useState } from "preact/hooks";
import { t } from "../app/language";
import { useAction } from "../members/row";
import { Failure } from "../ui/failure";
import { clockTime } from "../ui/words";
import type { PanelProps } from "./panel";

export default function LocksPanel({ object }: PanelProps) {
  const [held, setHeld] = useState<{ kind: string; since: number } | null>(null);
  const asking = useAction();
  useEffect(() => setHeld(null), [object]); // a lock ends with its session
  const take = (kind: "user" | "client"): void =>
    asking.run(async () => {
      await object?.lock(kind);
      setHeld({ kind, since: Date.now() });
    });
  const giveBack = (): void =>
    asking.run(async () => {
      await object?.unlock();
      setHeld(null);
    });
  const off = !object || asking.busy;
  return (
    <div class="locks-panel">
      <p role="status">
        {held ? t("Locked by this page since {0}.", clockTime(held.since)) : t("Not locked by this page.")}
      </p>
      <div class="row-line">
        {held ? (
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
