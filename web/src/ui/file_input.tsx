// A file that a person chooses, by a button elsewhere that clicks this. Layer: web/ui.

import type { RefObject } from "preact";

interface FileInputProps {
  input: RefObject<HTMLInputElement | null>;
  /** Endings and types, as of HTML. */
  accept: string;
  label: string;
  open: (chosen: File | undefined) => void;
}

/** The same file may be chosen again: it may be another by then. */
export function FileInput({ input, accept, label, open }: FileInputProps) {
  return (
    <input
      ref={input}
      type="file"
      accept={accept}
      hidden
      aria-label={label}
      onChange={(event) => {
        open(event.currentTarget.files?.[0]);
        event.currentTarget.value = "";
      }}
    />
  );
}
