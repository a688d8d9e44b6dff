// The word by which nobody takes the values of a recording for those of now.
// Layer: web/ui.

import { t } from "../app/language";
import { isReplay } from "../gateway/devices";

/** Nothing at a device that plays no recording. */
export function RecordingMark({ device }: { device: string }) {
  if (!isReplay(device)) return null;
  return (
    <span class="found-mark" title={t("Plays a recording: these are not the values of now")}>
      {t("recording")}
    </span>
  );
}
