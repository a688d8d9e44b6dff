// A number as it is typed: "-" and "0." are on the way to one, and change nothing yet. Layer: web/panels.

import { useState } from "preact/hooks";

export interface NumberFieldProps {
  label: string;
  value: number;
  least?: number;
  most?: number;
  change: (value: number) => void;
}

export function NumberField({ label, value, least = -Infinity, most = Infinity, change }: NumberFieldProps) {
  const [typed, setTyped] = useState<string | null>(null);
  const read = (text: string): number | null => {
    const number = Number(text);
    return text.trim() !== "" && Number.isFinite(number) && number >= least && number <= most ? number : null;
  };
  return (
    <input
      class="field"
      type="text"
      inputMode="decimal"
      aria-label={label}
      aria-invalid={typed !== null && read(typed) === null}
      value={typed ?? String(value)}
      onInput={(event) => {
        const text = event.currentTarget.value;
        setTyped(text);
        const number = read(text);
        if (number !== null) change(number);
      }}
      onBlur={() => setTyped(null)}
    />
  );
}
