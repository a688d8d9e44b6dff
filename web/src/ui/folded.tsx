// A part of a page that is closed at first. Layer: web/ui.

import type { ComponentChildren } from "preact";
import { useState } from "preact/hooks";

interface Props {
  /** Beside "subscriptions", which says how such parts look. */
  name?: string;
  summary: ComponentChildren;
  children: ComponentChildren;
}

/** What is within is there only while it is open: it may ask the gateway. */
export function Folded({ name, summary, children }: Props) {
  const [open, setOpen] = useState(false);
  return (
    <details
      class={name === undefined ? "subscriptions" : `subscriptions ${name}`}
      onToggle={(event) => setOpen(event.currentTarget.open)}
    >
      <summary>{summary}</summary>
      {open && children}
    </details>
  );
}
