// What users did last, for admins. Closed at first; asks when it is opened, and whenever somebody presses Show.
// Layer: web/pages.

import { useState } from "preact/hooks";
import { language, t } from "../app/language";
import { useStore } from "../app/store";
import { askDeeds } from "../gateway/audit";
import type { Deed, Deeds } from "../gateway/audit";
import { session } from "../gateway/session";
import { Folded } from "../ui/folded";
import { Ledger } from "../ui/ledger";
import { useAsked } from "../ui/use_asked";
import { clockTime, sentence } from "../ui/words";

export function AuditPart() {
  if (!useStore(session.who)?.admin) return null;
  return (
    <Folded name="audit-part" summary={t("What users did")}>
      <Search />
    </Folded>
  );
}

function Search() {
  const [user, setUser] = useState("");
  const [device, setDevice] = useState("");
  const [asked, setAsked] = useState({ user: "", device: "", turn: 0 });
  const { answer, failure } = useAsked((signal) => askDeeds(asked.user, asked.device, signal), JSON.stringify(asked));
  return (
    <>
      <form
        class="access-form"
        onSubmit={(event) => {
          event.preventDefault();
          setAsked({ user: user.trim(), device: device.trim(), turn: asked.turn + 1 });
        }}
      >
        <Pattern label={t("User")} value={user} set={setUser} />
        <Pattern label={t("Device")} value={device} set={setDevice} />
        <button class="button" type="submit">
          {t("Show")}
        </button>
      </form>
      <p class="note" role="status">
        {failure === null ? headline(answer) : sentence(failure)}
      </p>
      {answer && answer.list.length > 0 && <DeedTable deeds={answer.list} />}
    </>
  );
}

function Pattern({ label, value, set }: { label: string; value: string; set: (value: string) => void }) {
  return (
    <label>
      {label}{" "}
      <input
        class="field"
        type="text"
        autocapitalize="none"
        value={value}
        onInput={(event) => set(event.currentTarget.value)}
      />
    </label>
  );
}

function headline(answer: Deeds | null): string {
  if (!answer) return t("Asking the gateway for them.");
  if (!answer.isRecorded) return t("The gateway keeps no audit log: its configuration names no file for one.");
  if (answer.list.length === 0)
    return answer.isAll ? t("Nothing is recorded of that.") : t("Nothing of that is among the newest records.");
  return answer.isAll ? t("All that is recorded, the newest first.") : t("The newest records; there are older ones.");
}

const COLUMNS = ["Time", "User", "Event", "Member", "State"];

function DeedTable({ deeds }: { deeds: readonly Deed[] }) {
  return (
    <Ledger label={t("What users did")} columns={COLUMNS}>
      {deeds.map((each) => (
        <DeedRow key={each.seq} deed={each} />
      ))}
    </Ledger>
  );
}

function DeedRow({ deed }: { deed: Deed }) {
  const { at, user, client, event, outcome, device, path, member, detail } = deed;
  const isKnown = Number.isFinite(at);
  const place = [path, member].filter((each) => each !== "").join(".");
  return (
    <tr role="row" class={outcome === "ok" ? undefined : "is-failed"} data-deed={deed.seq}>
      <th role="rowheader" scope="row" title={isKnown ? new Date(at).toLocaleString(language) : undefined}>
        {isKnown ? clockTime(at) : "–"}
      </th>
      <td role="cell" data-label={t("User")} title={client}>
        {user || client || "–"}
      </td>
      <td role="cell" class="code" data-label={t("Event")}>
        {event}
      </td>
      <td role="cell" data-label={t("Member")}>
        {[device, place].filter((each) => each !== "").join(" · ")}
      </td>
      <td role="cell" data-label={t("State")}>
        {detail === "" ? outcome : `${outcome}: ${detail}`}
      </td>
    </tr>
  );
}
