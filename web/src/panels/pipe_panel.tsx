// A pipe: its packets, newest first, and a form to send one.
// Layer: web/panels.

import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import { t } from "../app/language";
import { useEach, useFeed } from "../live/use_feed";
import { Refusal } from "../members/refusal";
import { useAction } from "../members/row";
import { clockTimeMs } from "../ui/words";
import { formatValue } from "../values/format";
import { DraftInput } from "./draft_input";
import { Outlet } from "./outlet";
import { membersFor, textIn } from "./panel";
import type { PanelProps } from "./panel";
import { Freshness, MemberSelect } from "./parts";
import { useDrafts } from "./use_drafts";

const MOST = 100;
const SHOW_MS = 100;

export default function PipePanel(props: PanelProps) {
  const { object, members, settings, change } = props;
  const choices = membersFor("pipe", members);
  const name = textIn(settings, "member") || choices[0]?.name || "";
  const member = choices.find((each) => each.name === name);
  const receives = member !== undefined && !member.modifiers.includes("writeonly");
  return (
    <div class="pipe-panel">
      <div class="panel-tools">
        <MemberSelect members={choices} chosen={name} choose={(next) => change({ member: next })} />
      </div>
      {choices.length === 0 && <p class="note">{t("This object has no pipes.")}</p>}
      {receives && <Packets key={name} object={object} name={name} />}
      {member && !member.modifiers.includes("readonly") && (
        <SendForm key={`send ${name}`} {...props} name={name} type={member.type} />
      )}
    </div>
  );
}

interface Packet {
  number: number;
  time: number;
  value: unknown;
}

function Packets({ object, name }: { object: PanelProps["object"]; name: string }) {
  const look = useFeed(object, "pipe", name);
  const kept = useRef<Packet[]>([]);
  const [shown, setShown] = useState<readonly Packet[]>([]);
  useEach(object, "pipe", name, (value) => {
    kept.current.unshift({ number: (kept.current[0]?.number ?? 0) + 1, time: Date.now(), value });
    kept.current.length = Math.min(kept.current.length, MOST);
  });
  useEffect(() => {
    const timer = setInterval(
      () => setShown((old) => (old[0]?.number === kept.current[0]?.number ? old : [...kept.current])),
      SHOW_MS,
    );
    return () => clearInterval(timer);
  }, []);
  return (
    <>
      <ol class="log panel-scroll" tabIndex={0} aria-label={t("Packets of {0}", name)}>
        {shown.map(({ number, time, value }) => (
          <li key={number}>
            <span class="log-number">{number}</span>
            <time class="log-time">{clockTimeMs(time)}</time>
            <span>{formatValue(value, 1)}</span>
          </li>
        ))}
      </ol>
      <Freshness look={look} isLive={object !== null} />
    </>
  );
}

function SendForm({ object, definitions, scope, place, name, type }: PanelProps & { name: string; type: string }) {
  const inputs = useMemo(() => [{ name, type }], [name, type]);
  const { fields, lost } = useDrafts(inputs, definitions, scope);
  const [sent, setSent] = useState(0);
  const outlet = useMemo(() => (object ? new Outlet(() => object.openPipe(name)) : null), [object, name]);
  const sending = useAction();
  useEffect(() => () => outlet?.close(), [outlet]);
  const send = (event: Event): void => {
    event.preventDefault();
    sending.run(async () => {
      if (!outlet) throw new Error(t("not connected"));
      await outlet.send(fields[0]?.value());
      setSent((count) => count + 1);
    });
  };
  return (
    <form class="member-form" onSubmit={send}>
      {fields.map(({ draft, change }) => (
        <DraftInput key={name} label={name} {...{ type, definitions, scope, draft, change }} />
      ))}
      <div class="row-line">
        <button class="button" type="submit" disabled={!object || sending.busy}>
          {t("Send")}
          <span class="unseen"> {name}</span>
        </button>
        {sent > 0 && <output class="note">{t("{0} sent", sent)}</output>}
      </div>
      <Refusal failure={sending.failure ?? lost} isLocked={sending.isLocked} object={object} place={place} />
    </form>
  );
}
