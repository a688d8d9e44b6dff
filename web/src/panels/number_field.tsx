// A number as it is typed: "-" and "0." are on the way to one, and change nothing yet. Where it has become none in the end, the
// number from before stays. Layer: web/panels.

import { useRef, useState } from "preact/hooks";

export interface NumberFieldProps {
  label: string;
  value: number;
  least?: number;
  most?: number;
  disabled?: boolean;
  change: (value: number) => void;
}

export function NumberField({ label, value, least = -Infinity, most = Infinity, disabled, change }: NumberFieldProps) {
  const [typed, setTyped] = useState<string | null>(null);
  const before = useRef(value);
  const read = (text: string): number | null => {
    const number = Number(text.replace(",", ".")); // as half of the world writes it
    return text.trim() !== "" && Number.isFinite(number) && number >= least && number <= most ? number : null;
  };
  return (
    <input
      class="field"
      type="text"
      inputMode="decimal"
      aria-label={label}
      disabled={disabled}
      aria-invalid={typed !== null && read(typed) === null}
      value={typed ?? String(value)}
      onInput={(event) => {
        const text = event.currentTarget.value;
        if (typed === null) before.current = value;
        setTyped(text);
        const number = read(text);
        if (number !== null) change(number);
      }}
      onBlur={() => {
        if (typed !== null && read(typed) === null) change(before.current);
        setTyped(null);
      }}
    />
  );
}
