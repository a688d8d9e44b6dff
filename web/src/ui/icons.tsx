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
      <path class="mark-wake" d="M2 26c8 1 9-5 14-8.500s6-9 14-8.500" />
      <rect class="mark-post" x="8.500" y="4" width="3.600" height="24" rx="1.300" />
      <rect class="mark-post" x="19.900" y="4" width="3.600" height="24" rx="1.300" />
    </svg>
  );
}

export function SunMoonIcon({ theme }: { theme: "system" | "light" | "dark" }) {
  if (theme === "light") {
    return (
      <Icon>
        <circle cx="10" cy="10" r="3.500" fill="none" stroke="currentColor" stroke-width="1.600" />
        <path
          d="M10 2v2.200M10 15.800V18M2 10h2.200M15.800 10H18M4.300 4.300l1.600 1.600M14.100 14.100l1.600 1.600M15.700 4.300l-1.600 1.600M5.900 14.100l-1.600 1.600"
          stroke="currentColor"
          stroke-width="1.600"
          stroke-linecap="round"
        />
      </Icon>
    );
  }
  if (theme === "dark") {
    return (
      <Icon>
        <path
          d="M16.500 12.200A7 7 0 0 1 7.800 3.500a7 7 0 1 0 8.700 8.700Z"
          fill="none"
          stroke="currentColor"
          stroke-width="1.600"
          stroke-linejoin="round"
        />
      </Icon>
    );
  }
  return (
    <Icon>
      <circle cx="10" cy="10" r="6.500" fill="none" stroke="currentColor" stroke-width="1.600" />
      <path d="M10 3.500a6.500 6.500 0 0 1 0 13Z" fill="currentColor" />
    </Icon>
  );
}

const TURNS = { forward: 0, right: 90, back: 180, left: 270 } as const;

export function ArrowIcon({ towards }: { towards: keyof typeof TURNS }) {
  return (
    <Icon size={26}>
      <path d="M10 3.500 16.500 11H12v5.500H8V11H3.500Z" fill="currentColor" transform={`rotate(${TURNS[towards]} 10 10)`} />
    </Icon>
  );
}
