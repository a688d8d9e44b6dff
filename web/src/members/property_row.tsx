// A property: its value, read when shown and on request, and a field to set it.
// Layer: web/members.

import { useEffect, useRef, useState } from "preact/hooks";
import { t } from "../app/language";
import { Failure } from "../ui/failure";
import { useAge } from "../ui/use_age";
import { formatValue } from "../values/format";
import { PATIENT, RowHead, useAction } from "./row";
import type { MemberRowProps } from "./row";
import { ValueForm } from "./value_form";

export function PropertyRow(props: MemberRowProps) {
  const { object, member, live } = props;
  const readable = !member.modifiers.includes("writeonly");
  const writable = !member.modifiers.includes("readonly");
  const reading = useAction();
  const [shown, setShown] = useState<string | null>(null);
  const readAt = useRef<number | null>(null);
  const isCurrent = live && reading.failure === null;
  const age = useAge(() => (isCurrent ? null : readAt.current));
  const read = (): void =>
    reading.run(async () => {
      setShown(formatValue(await object.get(member.name)));
      readAt.current = performance.now();
    });
  useEffect(() => {
    if (live && readable) read();
  }, [object, live]);
  const write = async (value: unknown): Promise<void> => {
    await object.set(member.name, value, PATIENT);
    if (readable) read(); // what fails there says nothing of what was set
  };
  return (
    <>
      <RowHead member={member} />
      {readable && (
        <div class={`row-line ${age === null ? "" : "is-stale"}`}>
          <output class="value">{shown ?? (reading.busy ? t("reading …") : t("not read"))}</output>
          <button class="button" type="button" disabled={!live || reading.busy} onClick={read}>
            {t("Read")}
            <span class="unseen"> {member.name}</span>
          </button>
          {age !== null && <p class="note">{t("Stale: {0}", age)}</p>}
        </div>
      )}
      <Failure text={reading.failure} />
      {writable && <ValueForm {...props} label={t("New value of {0}", member.name)} word={t("Set")} give={write} />}
    </>
  );
}
