// Every member of any object: to read, write, call, follow and open, without knowing the device.
// Layer: web/pages.

import type { ComponentType } from "preact";
import { t } from "../app/language";
import type { Route } from "../app/router";
import { CallbackRow } from "../members/callback_row";
import { EventRow } from "../members/event_row";
import { FunctionRow } from "../members/function_row";
import { MemoryRow } from "../members/memory_row";
import { ObjrefRow } from "../members/objref_row";
import { PipeRow } from "../members/pipe_row";
import { PropertyRow } from "../members/property_row";
import type { MemberRowProps } from "../members/row";
import { WireRow } from "../members/wire_row";
import type { Member, MemberKind, Remote } from "../robot/remote";

const GROUPS: readonly { kind: MemberKind; title: string; Row: ComponentType<MemberRowProps> }[] = [
  { kind: "objref", title: "Objects", Row: ObjrefRow },
  { kind: "property", title: "Properties", Row: PropertyRow },
  { kind: "function", title: "Functions", Row: FunctionRow },
  { kind: "wire", title: "Wires", Row: WireRow },
  { kind: "event", title: "Events", Row: EventRow },
  { kind: "pipe", title: "Pipes", Row: PipeRow },
  { kind: "callback", title: "Callbacks", Row: CallbackRow },
  { kind: "memory", title: "Memories", Row: MemoryRow },
];

export interface ObjectViewProps {
  object: Remote;
  /** False while the connection is lost: what was read stays, nothing can be done. */
  live: boolean;
  route: Route & { page: "service" };
}

export function ObjectView({ object, live, route }: ObjectViewProps) {
  const groups = GROUPS.map((group) => ({ ...group, members: object.members.filter((m) => m.kind === group.kind) }));
  return (
    <div class="object">
      <p class="object-type">
        {t("Object of type")} <code>{object.type}</code>
      </p>
      {object.members.length === 0 && <p class="empty">{t("This object has no members.")}</p>}
      {groups
        .filter((group) => group.members.length > 0)
        .map(({ kind, title, Row, members }) => (
          <section key={kind} class="group" aria-labelledby={`group-${kind}`}>
            <h2 id={`group-${kind}`}>{t(title)}</h2>
            <ul class="rows">
              {members.map((member) => (
                <li key={keyOf(member)} class="row" data-member={member.name}>
                  <Row object={object} member={member} live={live} route={route} />
                </li>
              ))}
            </ul>
          </section>
        ))}
    </div>
  );
}

/** What is typed in stays over an outage, unless the definition asks for something else since then. */
function keyOf({ name, type, parameters }: Member): string {
  return [name, type, ...parameters.map((each) => `${each.type} ${each.name}`)].join();
}
