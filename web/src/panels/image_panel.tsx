// Pictures of a pipe, a wire, a property, or a function that takes one: the newest, as often as the screen can show it.
// Layer: web/panels.

import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import { t } from "../app/language";
import { drawFrame } from "../camera/draw_frame";
import { useFeed } from "../live/use_feed";
import { useAction } from "../members/row";
import { explain } from "../robot/remote";
import { Failure } from "../ui/failure";
import { membersFor, textIn } from "./panel";
import type { PanelProps } from "./panel";
import { feedKindOf, Freshness, MemberSelect } from "./parts";
import "./image_panel.css";

const EMPTY = [4, 3] as const;

export default function ImagePanel({ object, members, place, settings, change }: PanelProps) {
  const choices = useMemo(() => membersFor("image", members), [members]);
  const name = textIn(settings, "member") || choices[0]?.name || "";
  const member = choices.find((each) => each.name === name);
  const start = ["StartStreaming", "start_streaming"].find((each) =>
    members.some((m) => m.kind === "function" && m.name === each && m.parameters.length === 0),
  );
  const kind = member?.kind === "function" ? null : feedKindOf(member);
  const canvas = useRef<HTMLCanvasElement>(null);
  const look = useFeed(object, kind, name);
  const [shown, setShown] = useState<{ size: string; failure: string | null }>({ size: "", failure: null });
  const acting = useAction();
  const source = [place.device, place.service, place.object, name].join("/");
  // Each source has a canvas of its own: what comes late from another one is drawn where nobody sees it.
  const draw = async (value: unknown, on: HTMLCanvasElement | null): Promise<void> => {
    const show = (next: { size?: string; failure: string | null }): void => {
      if (canvas.current !== on) return;
      setShown((old) =>
        old.failure === next.failure && old.size === (next.size ?? old.size) ? old : { ...old, ...next },
      );
    };
    try {
      show({ size: await drawFrame(on, value), failure: null });
    } catch (error) {
      show({ failure: explain(error) });
    }
  };
  useEffect(() => setShown({ size: "", failure: null }), [source]);
  const feed = look.feed;
  useEffect(() => {
    if (!feed || feed.kind !== kind || feed.member !== name) return;
    let drawn: unknown = undefined;
    let isDrawing = false;
    let frame = 0;
    const next = (): void => {
      frame = requestAnimationFrame(next);
      if (isDrawing || feed.newest === undefined || feed.newest === drawn) return;
      drawn = feed.newest;
      isDrawing = true;
      void draw(drawn, canvas.current).finally(() => (isDrawing = false));
    };
    next();
    return () => cancelAnimationFrame(frame);
  }, [feed, kind, name]);
  const take = (): void =>
    acting.run(async () => {
      const on = canvas.current;
      await draw(await object?.call(name, []), on);
    });
  const begin = (): void => acting.run(async () => void (start && (await object?.call(start, []))));
  const save = (): void =>
    canvas.current?.toBlob((blob) => {
      if (!blob) return;
      const link = document.createElement("a");
      link.href = URL.createObjectURL(blob);
      link.download = `${name}.png`;
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
    });
  const streams = look.rate > 0; // regularly: one picture alone does not say so
  const starter = kind === "pipe" && start && !streams && (
    <button
      class={shown.size === "" ? "button" : "button button-quiet"}
      type="button"
      disabled={!object || acting.busy}
      onClick={begin}
    >
      {t("Start stream")}
    </button>
  );
  return (
    <div class="image-panel">
      <div class="panel-tools">
        <MemberSelect members={choices} chosen={name} choose={(next) => change({ ...settings, member: next })} />
        {member?.kind === "function" && (
          <button class="button" type="button" disabled={!object || acting.busy} onClick={take}>
            {t("Take")}
          </button>
        )}
        <button class="button button-quiet" type="button" disabled={shown.size === ""} onClick={save}>
          PNG
        </button>
        {shown.size !== "" && starter}
      </div>
      <div class={`image-box ${look.stale === null ? "" : "is-stale"}`}>
        <canvas
          key={source}
          ref={canvas}
          width={EMPTY[0]}
          height={EMPTY[1]}
          role="img"
          aria-label={t("Picture of {0}", name)}
        />
        {shown.size === "" && starter}
      </div>
      <Failure text={shown.failure ?? acting.failure} />
      <div class="panel-foot">
        {kind !== null && <Freshness look={look} isLive={object !== null} />}
        <span class="note">{shown.size}</span>
      </div>
    </div>
  );
}
