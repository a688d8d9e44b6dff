// A state in shape, colour and word.
// Layer: web/ui.

export type BadgeState = "online" | "connecting" | "offline";

export function StateBadge({ state, text }: { state: BadgeState; text?: string }) {
  return (
    <span class={`badge badge-${state}`} data-state={state}>
      <svg width="10" height="10" viewBox="0 0 10 10" aria-hidden="true">
        {state === "online" && <circle cx="5" cy="5" r="5" fill="currentColor" />}
        {state === "connecting" && (
          <circle
            cx="5"
            cy="5"
            r="3.900"
            fill="none"
            stroke="currentColor"
            stroke-width="2"
            stroke-dasharray="4 2.100"
          />
        )}
        {state === "offline" && <path d="M1 1l8 8M9 1L1 9" stroke="currentColor" stroke-width="2.200" />}
      </svg>
      <span class="badge-word">{text ?? state}</span>
    </span>
  );
}
