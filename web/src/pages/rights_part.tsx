// What one may do, in the head line behind one's name. Closed at first; asks when it is opened.
// Layer: web/pages.

import type { ComponentChildren } from "preact";
import { useEffect, useState } from "preact/hooks";
import { t } from "../app/language";
import type { Who } from "../gateway/session";
import { loaded } from "../ui/loaded";
import type { RightsSheetProps } from "./rights_sheet";

const LoadedSheet = loaded<RightsSheetProps>(() => import("./rights_sheet"));

/** `children`: who one is. */
export function RightsPart({ who, children }: { who: Who; children: ComponentChildren }) {
  const [open, setOpen] = useState(false);
  useEffect(() => {
    if (!open) return;
    const close = ({ key }: KeyboardEvent): void => void (key === "Escape" && setOpen(false));
    window.addEventListener("keydown", close);
    return () => window.removeEventListener("keydown", close);
  }, [open]);
  return (
    <details class="rights" open={open} onToggle={(event) => setOpen(event.currentTarget.open)}>
      <summary title={t("What you may do")}>{children}</summary>
      {open && (
        <div class="rights-sheet">
          <h2>{t("What you may do")}</h2>
          <LoadedSheet who={who} />
        </div>
      )}
    </details>
  );
}
