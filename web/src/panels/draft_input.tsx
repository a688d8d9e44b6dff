// Fields for a value of any type: one for each word, groups for structs, rows for lists and maps.
// Layer: web/panels.

import { useId } from "preact/hooks";
import { t } from "../app/language";
import type { Definitions } from "../values/definitions";
import { freeKey, makeDraft, shapeOf } from "../values/draft";
import type { Draft, Shape } from "../values/draft";
import { placeholder } from "../values/parse";
import "./draft_input.css";

export interface DraftInputProps {
  label: string;
  type: string;
  definitions: Definitions;
  scope: string;
  draft: Draft;
  change: (draft: Draft) => void;
  documentation?: string;
}

export function DraftInput(props: DraftInputProps) {
  const { type, definitions, scope, draft } = props;
  const shape = shapeOf(type, definitions, scope);
  if (shape.kind === "struct" && draft.kind === "struct") return <StructInput {...props} shape={shape} draft={draft} />;
  if (shape.kind === "list" && draft.kind === "list") return <ListInput {...props} shape={shape} draft={draft} />;
  if (shape.kind === "map" && draft.kind === "map") return <MapInput {...props} shape={shape} draft={draft} />;
  return draft.kind === "text" ? <WordInput {...props} shape={shape} draft={draft} /> : null;
}

function WordInput({
  label,
  type,
  shape,
  draft,
  change,
  documentation,
}: DraftInputProps & { shape: Shape; draft: Extract<Draft, { kind: "text" }> }) {
  const { text } = draft;
  const id = useId();
  const changed = (event: Event): void => change({ ...draft, text: (event.currentTarget as HTMLInputElement).value });
  const names = shape.kind === "enum" ? shape.names : shape.kind === "bool" ? ["false", "true"] : null;
  return (
    <div class="value-input" title={documentation || undefined}>
      <label for={id} class="value-label">
        {label} <code>{type}</code>
      </label>
      {names ? (
        <select id={id} class="field" value={text} onChange={changed}>
          {!names.includes(text) && <option value={text}>{text}</option>}
          {names.map((name) => (
            <option key={name} value={name}>
              {name}
            </option>
          ))}
        </select>
      ) : (
        <input
          id={id}
          class="field"
          type="text"
          autocomplete="off"
          spellcheck={false}
          value={text}
          placeholder={shape.kind === "uuid" ? "00000000-0000-0000-0000-000000000000" : placeholder(type)}
          onInput={changed}
        />
      )}
    </div>
  );
}

type Of<K extends Shape["kind"] & Draft["kind"]> = Omit<DraftInputProps, "draft"> & {
  shape: Extract<Shape, { kind: K }>;
  draft: Extract<Draft, { kind: K }>;
};

function StructInput({ label, type, definitions, scope, shape, draft, change }: Of<"struct">) {
  const { fields } = draft;
  const fill = (): void => {
    const made = makeDraft(type, definitions, scope);
    if (made.kind === "struct") change(made);
  };
  return (
    <fieldset class="draft-group">
      <legend>
        {label} <code>{type}</code>{" "}
        <button
          class="button button-quiet"
          type="button"
          onClick={() => (fields === null ? fill() : change({ kind: "struct", fields: null }))}
        >
          {fields === null ? t("Fill in") : t("Leave empty")}
          <span class="unseen"> {label}</span>
        </button>
      </legend>
      {fields &&
        shape.fields.map((field) => (
          <DraftInput
            key={field.name}
            label={field.name}
            type={field.type}
            documentation={field.documentation}
            definitions={definitions}
            scope={shape.scope}
            draft={fields.get(field.name) ?? makeDraft(field.type, definitions, shape.scope)}
            change={(next) => change({ kind: "struct", fields: new Map(fields).set(field.name, next) })}
          />
        ))}
    </fieldset>
  );
}

function ListInput({ label, type, definitions, scope, shape, draft, change }: Of<"list">) {
  const { items } = draft;
  return (
    <fieldset class="draft-group">
      <legend>
        {label} <code>{type}</code>
      </legend>
      {items.map((item, i) => (
        <div class="draft-item" key={i}>
          <DraftInput
            label={`${label}[${i}]`}
            type={shape.item}
            definitions={definitions}
            scope={scope}
            draft={item}
            change={(next) => change({ kind: "list", items: items.map((old, at) => (at === i ? next : old)) })}
          />
          <RemoveButton
            what={`${label}[${i}]`}
            remove={() => change({ kind: "list", items: items.filter((_, at) => at !== i) })}
          />
        </div>
      ))}
      <AddButton
        label={label}
        add={() => change({ kind: "list", items: [...items, makeDraft(shape.item, definitions, scope)] })}
      />
    </fieldset>
  );
}

function MapInput({ label, type, definitions, scope, shape, draft, change }: Of<"map">) {
  const { entries } = draft;
  const set = (i: number, next: Partial<(typeof entries)[number]>): void =>
    change({ kind: "map", entries: entries.map((old, at) => (at === i ? { ...old, ...next } : old)) });
  const add = (): void =>
    change({
      kind: "map",
      entries: [
        ...entries,
        {
          key: freeKey(entries, shape.keys),
          value: makeDraft(shape.item, definitions, scope),
        },
      ],
    });
  return (
    <fieldset class="draft-group">
      <legend>
        {label} <code>{type}</code>
      </legend>
      {entries.map(({ key, value }, i) => (
        <div class="draft-item" key={i}>
          <WordInput
            label={t("Key")}
            type={shape.keys}
            definitions={definitions}
            scope={scope}
            shape={{ kind: "text", type: shape.keys }}
            draft={{ kind: "text", text: key }}
            change={(next) => next.kind === "text" && set(i, { key: next.text })}
          />
          <DraftInput
            label={`${label}[${key}]`}
            type={shape.item}
            definitions={definitions}
            scope={scope}
            draft={value}
            change={(next) => set(i, { value: next })}
          />
          <RemoveButton
            what={`${label}[${key}]`}
            remove={() => change({ kind: "map", entries: entries.filter((_, at) => at !== i) })}
          />
        </div>
      ))}
      <AddButton label={label} add={add} />
    </fieldset>
  );
}

function AddButton({ label, add }: { label: string; add: () => void }) {
  return (
    <button class="button button-quiet" type="button" onClick={add}>
      {t("Add")}
      <span class="unseen"> {label}</span>
    </button>
  );
}

function RemoveButton({ what, remove }: { what: string; remove: () => void }) {
  return (
    <button class="button button-quiet" type="button" onClick={remove}>
      {t("Remove")}
      <span class="unseen"> {what}</span>
    </button>
  );
}
