// A field for a value of any type: a switch for bool, a line for scalars and strings, several lines for the rest.
// Layer: web/members.

import { useId } from "preact/hooks";
import { isNumeric, parseType } from "../values/type_text";
import { placeholder } from "../values/parse";

export interface ValueInputProps {
  label: string;
  type: string;
  text: string;
  disabled: boolean;
  onText: (text: string) => void;
  /** Hides the label from the eye where the row already names the value. */
  quiet?: boolean;
}

export function ValueInput({ label, type, text, disabled, onText, quiet = false }: ValueInputProps) {
  const id = useId();
  const parsed = parseType(type);
  const scalar = parsed.array === "none" && parsed.container === "none";
  const common = { id, disabled, class: "field" };
  const changed = (event: Event): void => onText((event.currentTarget as HTMLInputElement).value);
  return (
    <div class="value-input">
      <label for={id} class={quiet ? "unseen" : "value-label"}>
        {label} <code>{type}</code>
      </label>
      {scalar && parsed.base === "bool" ? (
        <select {...common} value={text || "false"} onChange={changed}>
          <option value="false">false</option>
          <option value="true">true</option>
        </select>
      ) : !isNumeric(parsed.base) && !(scalar && parsed.base === "string") ? (
        <textarea
          {...common}
          rows={2}
          spellcheck={false}
          value={text}
          placeholder={placeholder(type)}
          onInput={changed}
        />
      ) : (
        <input
          {...common}
          type="text"
          autocomplete="off"
          spellcheck={false}
          value={text}
          placeholder={placeholder(type)}
          onInput={changed}
        />
      )}
    </div>
  );
}

/** What an untouched field stands for. */
export function initialText(type: string): string {
  return type === "bool" ? "false" : "";
}
