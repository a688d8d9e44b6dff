// A memory: its size, and the items of one range.
// Layer: web/members.

import { useEffect, useState } from "preact/hooks";
import { Failure } from "../ui/failure";
import { format_value } from "../values/format";
import { parse_input } from "../values/parse";
import { RowHead, useAction } from "./row";
import type { MemberRowProps } from "./row";
import { ValueInput } from "./value_input";

const MOST_AT_FIRST = 16; // items in each dimension that the form proposes to read

export function MemoryRow({ object, member, live }: MemberRowProps) {
  const measuring = useAction();
  const reading = useAction();
  const [size, set_size] = useState<readonly number[] | null>(null);
  const [position, set_position] = useState("[0]");
  const [count, set_count] = useState(`[${MOST_AT_FIRST}]`);
  const [shown, set_shown] = useState<string | null>(null);
  const readable = !member.modifiers.includes("writeonly");
  const measure = (): void =>
    measuring.run(async () => {
      const found = await object.dimensions(member.name);
      set_size(found);
      set_position(`[${found.map(() => 0).join(", ")}]`);
      set_count(`[${found.map((items) => Math.min(items, MOST_AT_FIRST)).join(", ")}]`);
    });
  useEffect(() => {
    if (live) measure();
  }, [object, live]);
  const read = (event: Event): void => {
    event.preventDefault();
    reading.run(async () => {
      const range = [position, count].map((text) => Array.from(parse_input(text, "uint32[]") as ArrayLike<number>));
      set_shown(format_value(await object.read(member.name, range[0] ?? [], range[1] ?? [])));
    });
  };
  return (
    <>
      <RowHead member={member} />
      <div class="row-line">
        <p class="note">{size === null ? "size not read" : `${size.join(" × ")} items`}</p>
        <button class="button" type="button" disabled={!live || measuring.busy} onClick={measure}>
          Measure<span class="unseen"> {member.name}</span>
        </button>
      </div>
      <Failure text={measuring.failure} />
      {readable && (
        <form class="row-line" onSubmit={read}>
          <ValueInput quiet label={`Position in ${member.name}`} type="uint32[]" text={position} disabled={!live} on_text={set_position} />
          <ValueInput quiet label={`Items of ${member.name}`} type="uint32[]" text={count} disabled={!live} on_text={set_count} />
          <button class="button" type="submit" disabled={!live || reading.busy}>
            Read<span class="unseen"> {member.name}</span>
          </button>
        </form>
      )}
      {shown !== null && <output class="value">{shown}</output>}
      <Failure text={reading.failure} />
    </>
  );
}
