// The frame of a panel: its name, its handles while the board is arranged, and what it shows.
// Layer: web/board.

import type { ComponentType } from "preact";
import { useEffect, useState } from "preact/hooks";
import { t } from "../app/language";
import type { Place } from "../app/router";
import type { DeviceList } from "../gateway/devices";
import { useDefinitions } from "../live/definitions";
import { useObject } from "../live/links";
import { KINDS, textIn } from "../panels/panel";
import type { PanelProps } from "../panels/panel";
import { sourcesOf } from "../panels/plot_sources";
import type { Link } from "../robot/link";
import { Failure } from "../ui/failure";
import { scopeOf } from "../values/definitions";
import type { Panel, PanelKind } from "./board";
import { Guard } from "./guard";
import { handleKey, useDrag } from "./handles";
import type { Change } from "./handles";
import { stopWithout, useSafe } from "./stop";

export interface PanelFrameProps {
  panel: Panel;
  link: Link;
  place: Place;
  services: readonly string[];
  list: DeviceList;
  arranging: boolean;
  move: Change;
  step: (dx: number, dy: number) => void;
  update: (change: Partial<Panel>) => void;
  /** What is set is for the members of the service before, and goes with it. */
  chooseService: (from: string) => void;
  remove: () => void;
}

export function PanelFrame({
  panel,
  link,
  place,
  services,
  list,
  arranging,
  move,
  step,
  update,
  chooseService,
  remove,
}: PanelFrameProps) {
  const path = [place.object, panel.object].filter((each) => each !== "" && panel.from === "").join(".");
  const { object, reach, last, failure } = useObject(link, panel.from, panel.from === "" ? path : panel.object, list);
  const definitions = useDefinitions(last);
  const Shown = useLoaded(panel.kind);
  const name = nameOf(panel);
  const [device = place.device, service = place.service] =
    panel.from === "" ? [] : panel.from.split("/").map(decodeURIComponent);
  const safe = useSafe({ device, service }, list);
  const remarks = [panel.from === "" ? "" : device, panel.object].filter((each) => each !== "" && each !== name);
  const drag = useDrag(panel, move);
  return (
    <div
      role="group"
      class={`board-panel ${arranging ? "is-arranged" : ""}`}
      aria-label={name}
      data-panel={panel.kind}
      style={{
        gridColumn: `${panel.x + 1} / span ${panel.w}`,
        gridRow: `${panel.y + 1} / span ${panel.h}`,
        "--rows": String(panel.h),
      }}
    >
      <header class="panel-head">
        {arranging ? (
          <>
            <button
              class="panel-handle"
              type="button"
              aria-label={t("Move or size {0}: arrow keys, with Shift to size", name)}
              onKeyDown={(event) => handleKey(event, panel, move, step)}
              {...drag.move}
            >
              <span aria-hidden="true">⠿</span>
            </button>
            <input
              class="panel-title-input"
              aria-label={t("Name of {0}", name)}
              value={panel.title}
              placeholder={name}
              onInput={(event) => update({ title: event.currentTarget.value })}
            />
            <button class="button button-quiet" type="button" onClick={remove}>
              {t("Remove")}
              <span class="unseen"> {name}</span>
            </button>
          </>
        ) : (
          <h2>
            {name}
            {remarks.length > 0 && <small> {remarks.join(" · ")}</small>}
          </h2>
        )}
      </header>
      {arranging && (
        <div class="panel-source">
          <label>
            <span class="unseen">{t("Service")}</span>
            <select class="field" value={panel.from} onChange={(event) => chooseService(event.currentTarget.value)}>
              <option value="">{t("this service")}</option>
              {[...new Set([...services, ...(panel.from === "" ? [] : [panel.from])])].map((each) => (
                <option key={each} value={each}>
                  {each.split("/").map(decodeURIComponent).join(" / ")}
                </option>
              ))}
            </select>
          </label>
          <input
            class="field"
            aria-label={t("Object of {0}", name)}
            placeholder={t("object")}
            title={t("such as Webcams[0]; may be empty")}
            defaultValue={panel.object}
            onChange={(event) => update({ object: event.currentTarget.value.trim() })}
          />
        </div>
      )}
      <div class="panel-body">
        <Failure text={failure} />
        {last && Shown && (
          <Guard key={panel.kind}>
            <Shown
              object={object}
              reach={reach}
              stopWithout={(cause) => stopWithout({ device, service }, safe, cause)}
              members={last.members}
              definitions={definitions}
              scope={scopeOf(last.type)}
              place={{ device, service, object: panel.from === "" ? path : panel.object }}
              settings={panel.settings}
              change={(settings) => update({ settings })}
            />
          </Guard>
        )}
        {!last && failure === null && <span class="bone" aria-hidden="true" />}
      </div>
      {arranging && <span class="panel-corner" aria-hidden="true" {...drag.size} />}
    </div>
  );
}

export function nameOf(panel: Panel): string {
  if (panel.title !== "") return t(panel.title); // titles of presets are known
  const member =
    panel.kind === "plot"
      ? sourcesOf(panel.settings, "")
          .map((each) => each.member)
          .join(", ")
      : textIn(panel.settings, "member");
  return member === "" ? t(KINDS[panel.kind].title) : member;
}

/** A panel's code, when a board has one. */
function useLoaded(kind: PanelKind): ComponentType<PanelProps> | null {
  const [loaded, setLoaded] = useState<{ kind: PanelKind; shown: ComponentType<PanelProps> } | null>(null);
  useEffect(() => {
    let isCurrent = true;
    KINDS[kind].load().then(
      ({ default: shown }) => isCurrent && setLoaded({ kind, shown }),
      () => undefined, // the strip above says that the gateway is away
    );
    return () => void (isCurrent = false);
  }, [kind]);
  return loaded?.kind === kind ? loaded.shown : null;
}
