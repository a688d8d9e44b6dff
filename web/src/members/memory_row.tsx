// A memory: its size, and the items of one range.
// Layer: web/members.

import { useEffect, useState } from "preact/hooks";
import { t } from "../app/language";
import { Failure } from "../ui/failure";
import { formatValue } from "../values/format";
import { parseInput } from "../values/parse";
import { RowHead, useAction } from "./row";
import type { MemberRowProps } from "./row";
import { ValueInput } from "./value_input";

const MOST_AT_FIRST = 16; // items in each dimension that the form proposes to read

export function MemoryRow({ object, member, live }: MemberRowProps) {
  const measuring = useAction();
  const reading = useAction();
  const [size, setSize] = useState<readonly number[] | null>(null);
  const [position, setPosition] = useState("[0]");
  const [count, setCount] = useState(`[${MOST_AT_FIRST}]`);
  const [shown, setShown] = useState<string | null>(null);
  const readable = !member.modifiers.includes("writeonly");
  const measure = (): void =>
    measuring.run(async () => {
      const found = await object.dimensions(member.name);
      setSize(found);
      setPosition(`[${found.map(() => 0).join(", ")}]`);
      setCount(`[${found.map((items) => Math.min(items, MOST_AT_FIRST)).join(", ")}]`);
    });
  useEffect(() => {
    if (live) measure();
  }, [object, live]);
  const read = (event: Event): void => {
    event.preventDefault();
    reading.run(async () => {
      const range = [position, count].map((text) => Array.from(parseInput(text, "uint32[]") as ArrayLike<number>));
      setShown(formatValue(await object.read(member.name, range[0] ?? [], range[1] ?? [])));
    });
  };
  return (
    <>
      <RowHead member={member} />
      <div class="row-line">
        <p class="note">{size === null ? t("size not read") : t("{0} items", size.join(" × "))}</p>
        <button class="button" type="button" disabled={!live || measuring.busy} onClick={measure}>
          {t("Measure")}
          <span class="unseen"> {member.name}</span>
        </button>
      </div>
      <Failure text={measuring.failure} />
      {readable && (
        <form class="row-line row-form" onSubmit={read}>
          <ValueInput
            label={t("Position in {0}", member.name)}
            type="uint32[]"
            text={position}
            disabled={!live}
            onText={setPosition}
          />
          <ValueInput
            label={t("Items of {0}", member.name)}
            type="uint32[]"
            text={count}
            disabled={!live}
            onText={setCount}
          />
          <button class="button" type="submit" disabled={!live || reading.busy}>
            {t("Read")}
            <span class="unseen"> {member.name}</span>
          </button>
        </form>
      )}
      {shown !== null && <output class="value">{shown}</output>}
      <Failure text={reading.failure} />
    </>
  );
}
