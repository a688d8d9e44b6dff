// A part of a memory: as numbers, bytes, or grey values; and a form to write one item or more.
// Layer: web/panels.

import { useEffect, useRef, useState } from "preact/hooks";
import { t } from "../app/language";
import { Refusal } from "../members/refusal";
import { useAction } from "../members/row";
import type { Member, Remote } from "../robot/remote";
import { formatValue } from "../values/format";
import { parseInput } from "../values/parse";
import { hexLines, greyPicture } from "./bytes";
import { membersFor, textIn } from "./panel";
import type { PanelProps } from "./panel";
import { MemberSelect } from "./parts";
import "./memory_panel.css";

type View = "array" | "hex" | "image";
const VIEWS: readonly View[] = ["hex", "array", "image"];
const AT_FIRST = 256;

export default function MemoryPanel({ object, place, members, settings, change }: PanelProps) {
  const choices = membersFor("memory", members);
  const name = textIn(settings, "member") || choices[0]?.name || "";
  const member = choices.find((each) => each.name === name);
  const view = VIEWS.find((each) => each === textIn(settings, "view")) ?? "hex";
  return (
    <div class="memory-panel panel-scroll">
      <div class="panel-tools">
        <MemberSelect members={choices} chosen={name} choose={(next) => change({ ...settings, member: next })} />
        <label>
          <span class="unseen">{t("Shown as")}</span>
          <select
            class="field"
            value={view}
            onChange={(event) => change({ ...settings, member: name, view: event.currentTarget.value })}
          >
            {VIEWS.map((each) => (
              <option key={each} value={each}>
                {t(each)}
              </option>
            ))}
          </select>
        </label>
      </div>
      <Items key={name} object={object} place={place} name={name} member={member} view={view} />
    </div>
  );
}

interface ItemsProps {
  object: Remote | null;
  place: PanelProps["place"];
  name: string;
  member: Member | undefined;
  view: View;
}

/** Of one memory: what is answered late is not shown as another's. */
function Items({ object, place, name, member, view }: ItemsProps) {
  const [size, setSize] = useState<readonly number[]>([]);
  const [position, setPosition] = useState("0");
  const [count, setCount] = useState(String(AT_FIRST));
  const [text, setText] = useState("");
  const [shown, setShown] = useState<{ value: unknown; from: number } | null>(null);
  const acting = useAction();
  const writing = useAction();
  const [hasWritten, setWritten] = useState(false);
  const placed = useRef(""); // the size that Position and Items are for: they stay over an outage, as the new items do
  useEffect(() => {
    setShown(null);
    if (!object || !member) return;
    acting.run(async () => {
      const found = await object.dimensions(name);
      setSize(found);
      const of = found.join();
      if (placed.current === of) return;
      placed.current = of;
      setPosition(found.map(() => 0).join(", "));
      setCount(found.map((items) => Math.min(items, found.length === 1 ? AT_FIRST : 32)).join(", "));
    });
  }, [object]);
  const numbers = (given: string): number[] => Array.from(parseInput(given, "uint32[]") as ArrayLike<number>);
  const read = (): void =>
    acting.run(async () => {
      const at = numbers(position);
      const value = await object?.read(name, at, numbers(count));
      setShown({ value, from: at[0] ?? 0 });
    });
  const isReadable = member?.modifiers.includes("writeonly") === false;
  const write = (event: Event): void => {
    event.preventDefault();
    setWritten(false);
    writing.run(async () => {
      await object?.write(name, numbers(position), parseInput(text, member?.type ?? ""));
      setWritten(true);
      if (isReadable) read(); // what fails there says nothing of what was written
    });
  };
  const off = !object || !member || acting.busy || writing.busy;
  return (
    <>
      <form class="row-line row-form" onSubmit={(event) => (event.preventDefault(), read())}>
        <TextField label={t("Position")} text={position} change={setPosition} />
        <TextField label={t("Items")} text={count} change={setCount} />
        <button class="button" type="submit" disabled={off || !isReadable}>
          {t("Read")}
        </button>
        <p class="note">{size.length === 0 ? "" : t("{0} items", size.join(" × "))}</p>
      </form>
      <Refusal failure={acting.failure} isLocked={acting.isLocked} object={object} place={place} />
      {shown && <Shown {...shown} view={view} />}
      {member && !member.modifiers.includes("readonly") && (
        <form class="row-line row-form" onSubmit={write}>
          <TextField label={t("New items")} text={text} change={setText} />
          <button class="button" type="submit" disabled={off}>
            {t("Write")}
          </button>
          {hasWritten && <output class="note">{t("done")}</output>}
        </form>
      )}
      <Refusal failure={writing.failure} isLocked={writing.isLocked} object={object} place={place} />
    </>
  );
}

function TextField({ label, text, change }: { label: string; text: string; change: (text: string) => void }) {
  return (
    <label class="value-input">
      <span class="value-label">{label}</span>
      <input class="field" type="text" value={text} onInput={(event) => change(event.currentTarget.value)} />
    </label>
  );
}

function Shown({ value, view, from }: { value: unknown; view: View; from: number }) {
  if (view === "image") return <Picture value={value} />;
  return (
    <pre class="json" tabIndex={0} data-memory>
      {view === "hex" ? (hexLines(value, from) ?? formatValue(value)) : formatValue(value)}
    </pre>
  );
}

function Picture({ value }: { value: unknown }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const picture = greyPicture(value);
  useEffect(() => {
    const place = canvas.current;
    if (!place || !picture) return;
    place.width = picture.width;
    place.height = picture.height;
    place.getContext("2d")?.putImageData(new ImageData(picture.rgba, picture.width, picture.height), 0, 0);
  });
  if (!picture) return <p class="note">{t("These items are no numbers that can be shown as a picture.")}</p>;
  return <canvas ref={canvas} class="memory-picture" role="img" aria-label={t("The items as grey values")} />;
}
