// For how long a device has not answered. Layer: web/ui.

import { t } from "../app/language";
import { oldness } from "../live/use_feed";

/** `silent`: milliseconds, as usePulse() tells them; null: nothing is shown. */
export function Silence({ silent }: { silent: number | null }) {
  return (
    silent !== null && (
      <p class="failure board-silent" role="alert">
        {t("The device has not answered for {0}.", oldness(silent))}
      </p>
    )
  );
}
