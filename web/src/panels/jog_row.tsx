// A line that moves one thing back and forth while a button is held, and says where it is. Layer: web/panels.

import type { ComponentChildren } from "preact";
import { t } from "../app/language";
import { JogButton } from "./jog_button";

export interface JogRowProps {
  name: string;
  value: number;
  unit: string;
  digits: number;
  /** False: it has no buttons, and only says where it is. */
  isJogged?: boolean;
  enabled: boolean;
  /** `direction`: 1 or -1. */
  jog: (direction: number, isHeld: () => boolean) => Promise<unknown>;
  /** Whether a movement that has begun may go on. */
  mayGoOn: () => boolean;
  stop: () => Promise<unknown>;
  fail: (text: string | null) => void;
  /** Between the buttons. */
  children?: ComponentChildren;
}

export function JogRow(props: JogRowProps) {
  const { name, value, unit, digits, isJogged = true, enabled, jog, mayGoOn, stop, fail, children } = props;
  const button = (label: string, sign: string, direction: number) =>
    isJogged && (
      <JogButton
        label={label}
        sign={sign}
        enabled={enabled}
        jog={(isHeld) => jog(direction, isHeld)}
        mayGoOn={mayGoOn}
        stop={stop}
        fail={fail}
      />
    );
  return (
    <>
      <span class="joint-name">{name}</span>
      {button(t("{0} back", name), "−", -1)}
      {children}
      {button(t("{0} forward", name), "+", 1)}
      <span class="joint-value">
        {fixed(value, digits)} {unit}
      </span>
    </>
  );
}

/** Always as many digits, so that a value that changes stays in its place; none is "-0.0000". */
function fixed(value: number, digits: number): string {
  return (Number(value.toFixed(digits)) + 0).toFixed(digits);
}
