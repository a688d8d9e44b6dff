// What a form does, to be copied as code.
// Layer: web/panels.

import { useState } from "preact/hooks";
import { t } from "../app/language";
import type { Member } from "../robot/remote";
import { asCode } from "./code";
import type { CodeLanguage, CodePlace, Types } from "./code";

const LANGUAGES: readonly CodeLanguage[] = ["JavaScript", "curl", "Python"];

export interface CodeProps {
  member: Member;
  values: () => readonly unknown[];
  place: CodePlace;
  types: Types;
}

export default function Code({ member, values, place, types }: CodeProps) {
  const [shown, setShown] = useState<{ language: CodeLanguage; text: string; isCopied: boolean } | null>(null);
  const show = (language: CodeLanguage): void => {
    let text: string;
    try {
      text = asCode(language, new URL(".", document.baseURI).href, place, member, values(), types);
    } catch (error) {
      return setShown({ language, text: (error as Error).message, isCopied: false });
    }
    setShown({ language, text, isCopied: false });
    navigator.clipboard?.writeText(text).then(
      () => setShown({ language, text, isCopied: true }),
      () => undefined, // the text is there to be selected
    );
  };
  return (
    <>
      <div class="row-line">
        {LANGUAGES.map((language) => (
          <button
            key={language}
            class="button button-quiet"
            type="button"
            aria-pressed={shown?.language === language}
            onClick={() => show(language)}
          >
            {language}
          </button>
        ))}
        {shown?.isCopied && <span class="note">{t("copied")}</span>}
      </div>
      {shown && (
        <pre class="json" tabIndex={0}>
          {shown.text}
        </pre>
      )}
    </>
  );
}
