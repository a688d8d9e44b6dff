// Light, dark, or as the system says. The choice is kept in this browser; public/theme.js applies it before first paint.
// Layer: web/app.

import { Store } from "./store";

export type Theme = "system" | "light" | "dark";

const KEY = "rrgate-theme";

export const theme = new Store<Theme>(readTheme());

theme.watch((chosen) => {
  if (chosen === "system") delete document.documentElement.dataset["theme"];
  else document.documentElement.dataset["theme"] = chosen;
  try {
    if (chosen === "system") localStorage.removeItem(KEY);
    else localStorage.setItem(KEY, chosen);
  } catch {
    // Storage may be forbidden; the choice then lasts as long as the page.
  }
});

/** Runs `changed` whenever the colours on the page change, by choice or by the system. */
export function onColoursChanged(changed: () => void): () => void {
  const system = matchMedia("(prefers-color-scheme: dark)");
  system.addEventListener("change", changed);
  const unwatch = theme.watch(changed);
  return () => {
    system.removeEventListener("change", changed);
    unwatch();
  };
}

function readTheme(): Theme {
  const chosen = document.documentElement.dataset["theme"];
  return chosen === "light" || chosen === "dark" ? chosen : "system";
}
