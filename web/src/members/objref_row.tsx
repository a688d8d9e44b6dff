// A reference to another object: a link to its page, with a field for the index where it needs one.
// Layer: web/members.

import { useState } from "preact/hooks";
import { format_route } from "../app/router";
import { RowHead } from "./row";
import type { MemberRowProps } from "./row";
import { ValueInput } from "./value_input";
import { Failure } from "../ui/failure";
import { parse_input } from "../values/parse";

export function ObjrefRow({ member, route, live }: MemberRowProps) {
  const [index, set_index] = useState("");
  const [failure, set_failure] = useState<string | null>(null);
  const index_type = member.type.endsWith("{string}") ? "string" : /(\{int32\}|\[\])$/.test(member.type) ? "int32" : null;
  const address = (at: string | null): string =>
    format_route(route.device, route.service, [...route.path, { member: member.name, index: at }]);
  const open = (event: Event): void => {
    event.preventDefault();
    try {
      const at = String(parse_input(index, index_type ?? "string"));
      if (at === "") throw new Error("nothing given; expected a key");
      location.hash = address(at);
    } catch (error) {
      set_failure((error as Error).message);
    }
  };
  return (
    <>
      <RowHead member={member} />
      {index_type === null ? (
        <a class="button" href={address(null)}>
          Open<span class="unseen"> {member.name}</span>
        </a>
      ) : (
        <form class="row-line" onSubmit={open}>
          <ValueInput
            quiet
            label={`Index of ${member.name}`}
            type={index_type}
            text={index}
            disabled={!live}
            on_text={(text) => (set_index(text), set_failure(null))}
          />
          <button class="button" type="submit" disabled={!live}>
            Open<span class="unseen"> {member.name}</span>
          </button>
        </form>
      )}
      <Failure text={failure} />
    </>
  );
}
