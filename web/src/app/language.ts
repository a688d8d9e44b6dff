// The language of the page: texts are written in English where they are used; src/messages/ has them in others.
// Layer: web/app.

export const LANGUAGES = { en: "English", de: "Deutsch" } as const;
export type Language = keyof typeof LANGUAGES;

const KEY = "rrgate-language";
let messages: Readonly<Record<string, string>> = {};

export const language: Language = readLanguage();

/** Before anything is shown. */
export async function loadLanguage(): Promise<void> {
  document.documentElement.lang = language;
  if (language === "de") messages = (await import("../messages/de")).default;
}

/** Starts the page anew in this language. */
export function chooseLanguage(chosen: Language): void {
  try {
    localStorage.setItem(KEY, chosen);
  } catch {
    return; // without storage it would come back as it was
  }
  location.reload();
}

/** The text in the reader's language; `{0}` stands for the first of `values`. */
export function t(text: string, ...values: readonly (string | number)[]): string {
  const found = Object.hasOwn(messages, text) ? (messages[text] ?? text) : text;
  return found.replace(/\{(\d)\}/g, (whole, index: string) => String(values[Number(index)] ?? whole));
}

function readLanguage(): Language {
  let chosen: string | null = null;
  try {
    chosen = localStorage.getItem(KEY);
  } catch {
    // Storage may be forbidden; the browser's language stands.
  }
  const wanted = chosen ?? (typeof navigator === "undefined" ? "en" : navigator.language);
  return wanted.startsWith("de") ? "de" : "en";
}
