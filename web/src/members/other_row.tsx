// Pipes, callbacks and memories: named and typed, not yet operated from this page.
// Layer: web/members.

import { RowHead } from "./row";
import type { MemberRowProps } from "./row";

export function OtherRow({ member }: MemberRowProps) {
  const signature =
    member.kind === "callback"
      ? `(${member.parameters.map((p) => `${p.type} ${p.name}`).join(", ")}) → ${member.type}`
      : member.type;
  return (
    <>
      <RowHead member={member} signature={signature} />
      <p class="note">Shown for reference; this page cannot use a {member.kind} yet.</p>
    </>
  );
}
