// A line that moves one thing back and forth while a button is held, and says where it is. Layer: web/panels.

import type { ComponentChildren } from "preact";
import { t } from "../app/language";
import { formatNumber } from "../values/format";
import { JogButton } from "./jog_button";

export interface JogRowProps {
  name: string;
  value: number;
  unit: string;
  digits: number;
  enabled: boolean;
  /** `direction`: 1 or -1. */
  jog: (direction: number, isHeld: () => boolean) => Promise<unknown>;
  stop: () => Promise<unknown>;
  fail: (text: string | null) => void;
  /** Between the buttons. */
  children?: ComponentChildren;
}

export function JogRow({ name, value, unit, digits, enabled, jog, stop, fail, children }: JogRowProps) {
  return (
    <>
      <span class="joint-name">{name}</span>
      <JogButton
        label={t("{0} back", name)}
        sign="−"
        enabled={enabled}
        jog={(isHeld) => jog(-1, isHeld)}
        stop={stop}
        fail={fail}
      />
      {children}
      <JogButton
        label={t("{0} forward", name)}
        sign="+"
        enabled={enabled}
        jog={(isHeld) => jog(1, isHeld)}
        stop={stop}
        fail={fail}
      />
      <span class="joint-value">
        {formatNumber(Number(value.toFixed(digits)))} {unit}
      </span>
    </>
  );
}
