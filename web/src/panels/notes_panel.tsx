// Words that belong to the board: what to look at, whom to call.
// Layer: web/panels.

import { t } from "../app/language";
import { textIn } from "./panel";
import type { PanelProps } from "./panel";
import "./notes_panel.css";

export default function NotesPanel({ settings, change }: PanelProps) {
  return (
    <textarea
      class="field notes"
      aria-label={t("Notes")}
      placeholder={t("Notes")}
      maxLength={4000}
      value={textIn(settings, "text")}
      onInput={(event) => change({ text: event.currentTarget.value })}
    />
  );
}
