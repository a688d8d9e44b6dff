// A failure, shown where it happened.
// Layer: web/ui.

export function Failure({ text }: { text: string | null }) {
  return (
    <p class="failure" role="alert" hidden={text === null}>
      {text}
    </p>
  );
}
