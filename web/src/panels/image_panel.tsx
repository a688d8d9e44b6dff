// Pictures of a pipe, a wire, a property, or a function that takes one: the newest, as often as the screen can show it.
// Layer: web/panels.

import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import { t } from "../app/language";
import { drawFrame } from "../camera/draw_frame";
import { useNow } from "../app/store";
import type { Feed } from "../live/feed";
import { lookAt, useFeed } from "../live/use_feed";
import { useAction } from "../members/row";
import { explain } from "../robot/remote";
import { Failure } from "../ui/failure";
import { membersFor, textIn } from "./panel";
import type { PanelProps } from "./panel";
import { feedKindOf, Freshness, MemberSelect } from "./parts";
import "./image_panel.css";

const EMPTY = [4, 3] as const;

interface Shown {
  size: string;
  failure: string | null;
  /** Where the picture came by; null: by a call, or there is none. */
  from: Feed | null;
}
const NOTHING: Shown = { size: "", failure: null, from: null };

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
  const [shown, setShown] = useState<Shown>(NOTHING);
  const acting = useAction();
  const source = [place.device, place.service, place.object, name].join("/");
  // Each source has a canvas of its own: what comes late from another one is drawn where nobody sees it.
  const draw = async (value: unknown, on: HTMLCanvasElement | null, from: Feed | null): Promise<void> => {
    const show = (next: Partial<Shown>): void => {
      if (canvas.current !== on) return;
      setShown((old) => {
        const now = { ...old, ...next };
        return old.failure === now.failure && old.size === now.size && old.from === now.from ? old : now;
      });
    };
    try {
      show({ size: await drawFrame(on, value), failure: null, from });
    } catch (error) {
      show({ failure: explain(error) });
    }
  };
  useEffect(() => setShown(NOTHING), [source]);
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
      void draw(drawn, canvas.current, feed).finally(() => (isDrawing = false));
    };
    next();
    return () => cancelAnimationFrame(frame);
  }, [feed, kind, name]);
  const take = (): void =>
    acting.run(async () => {
      const on = canvas.current;
      await draw(await object?.call(name, []), on, null);
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
  useNow(1_000); // the picture ages
  // Of a connection that was lost: old until the one that there is now has sent one.
  const isOfBefore = shown.from !== null && shown.from !== feed;
  const seen = isOfBefore ? { ...lookAt(shown.from as Feed, false, performance.now()), failure: look.failure } : look;
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
      <div class={`image-box ${isOfBefore || look.stale !== null ? "is-stale" : ""}`}>
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
        {kind !== null && <Freshness look={seen} isLive={object !== null && !isOfBefore} />}
        <span class="note">{shown.size}</span>
      </div>
    </div>
  );
}
