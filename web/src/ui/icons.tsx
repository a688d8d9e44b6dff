// The few signs of the page, drawn on a 20 by 20 grid in the text's colour.
// Layer: web/ui.

import type { ComponentChildren } from "preact";

function Icon({ children, size = 20 }: { children: ComponentChildren; size?: number }) {
  return (
    <svg class="icon" width={size} height={size} viewBox="0 0 20 20" aria-hidden="true" focusable="false">
      {children}
    </svg>
  );
}

/** The mark: a wake that passes between two gate posts. */
export function Mark() {
  return (
    <svg class="mark" width="30" height="30" viewBox="0 0 32 32" aria-hidden="true" focusable="false">
      <path class="mark-wake" d="M2 26c8 1 9-5 14-8.5s6-9 14-8.5" />
      <rect class="mark-post" x="8.5" y="4" width="3.6" height="24" rx="1.3" />
      <rect class="mark-post" x="19.9" y="4" width="3.6" height="24" rx="1.3" />
    </svg>
  );
}

/** A globe. */
export function LanguageIcon() {
  return (
    <Icon>
      <g fill="none" stroke="currentColor" stroke-width="1.6">
        <circle cx="10" cy="10" r="7" />
        <ellipse cx="10" cy="10" rx="3" ry="7" />
        <path d="M3.3 8h13.4M3.3 12h13.4" />
      </g>
    </Icon>
  );
}

export function SunMoonIcon({ theme }: { theme: "system" | "light" | "dark" }) {
  if (theme === "light") {
    return (
      <Icon>
        <circle cx="10" cy="10" r="3.5" fill="none" stroke="currentColor" stroke-width="1.6" />
        <path
          d="M10 2v2.2M10 15.8V18M2 10h2.2M15.8 10H18M4.3 4.3l1.6 1.6M14.1 14.1l1.6 1.6M15.7 4.3l-1.6 1.6M5.9 14.1l-1.6 1.6"
          stroke="currentColor"
          stroke-width="1.6"
          stroke-linecap="round"
        />
      </Icon>
    );
  }
  if (theme === "dark") {
    return (
      <Icon>
        <path
          d="M16.5 12.2A7 7 0 0 1 7.8 3.5a7 7 0 1 0 8.7 8.7Z"
          fill="none"
          stroke="currentColor"
          stroke-width="1.6"
          stroke-linejoin="round"
        />
      </Icon>
    );
  }
  return (
    <Icon>
      <circle cx="10" cy="10" r="6.5" fill="none" stroke="currentColor" stroke-width="1.6" />
      <path d="M10 3.5a6.5 6.5 0 0 1 0 13Z" fill="currentColor" />
    </Icon>
  );
}

const TURNS = { forward: 0, right: 90, back: 180, left: 270 } as const;

export function ArrowIcon({ towards }: { towards: keyof typeof TURNS }) {
  return (
    <Icon size={26}>
      <path d="M10 3.5 16.5 11H12v5.5H8V11H3.5Z" fill="currentColor" transform={`rotate(${TURNS[towards]} 10 10)`} />
    </Icon>
  );
}
