// Numbers over time: any of wires, properties and pipes, by their path; pause, zoom, cursor, and a file of what is shown.
// Layer: web/panels. Drawn by uPlot.

import { useCallback, useEffect, useMemo, useRef, useState } from "preact/hooks";
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { t } from "../app/language";
import { onColoursChanged } from "../app/theme";
import { readPalette } from "../chart/palette";
import { drawInTurn, leaveTurn } from "../chart/turns";
import type { FeedKind } from "../live/feed";
import { useEach, useFeed } from "../live/use_feed";
import type { Remote } from "../robot/remote";
import { unitOf } from "../values/units";
import { numberPaths, numberReader } from "../values/paths";
import { saveFile } from "../ui/save_file";
import { membersFor, numberIn, textIn, textsIn } from "./panel";
import type { PanelProps } from "./panel";
import { feedKindOf, Freshness, MemberSelect } from "./parts";
import { lonely, Trace, toCsv } from "./trace";

const DRAW_MS = 100;
const AT_FIRST = 4;
const WINDOWS = [10, 30, 120, 600];

export default function PlotPanel(props: PanelProps) {
  const { object, members, settings, change, definitions, scope } = props;
  const choices = membersFor("plot", members);
  const name = textIn(settings, "member") || choices[0]?.name || "";
  const member = choices.find((each) => each.name === name);
  const seconds = numberIn(settings, "seconds", 30, 1, 3600);
  const kind = feedKindOf(member);
  const [first, setFirst] = useState<{ of: string; object: Remote | null; paths: readonly string[] }>(NOTHING);
  const available = first.of === name ? first.paths : NOTHING.paths;
  const chosen = textsIn(settings, "paths");
  const paths = chosen.length > 0 ? chosen : preferred(available).slice(0, AT_FIRST);
  const key = JSON.stringify([name, paths]);
  const trace = useMemo(() => new Trace(paths.length), [key]);
  const readers = useMemo(() => paths.map(numberReader), [key]);
  const [paused, setPaused] = useState(false);
  useEach(object, kind, name, (value, now, isAfterGap) => {
    if (first.of !== name || first.object !== object) setFirst({ of: name, object, paths: numberPaths(value) });
    if (isAfterGap) trace.breakOff();
    trace.push(
      now,
      readers.map((read) => read(value)),
    );
  });
  const type = member?.type ?? "";
  const label = useCallback(
    (path: string): string => {
      const unit = unitOf(type, path, definitions, scope);
      const shown = path === "" ? name : path;
      return unit === "" ? shown : `${shown} [${unit}]`;
    },
    [name, type, definitions, scope],
  );
  const labels = useMemo(() => paths.map(label), [key, label]);
  const save = (): void =>
    saveFile(`${name}.csv`, "text/csv", toCsv(["time_s", ...paths.map((path) => path || name)], trace));
  const pick = (path: string, on: boolean): void =>
    change({ ...settings, member: name, paths: on ? [...paths, path] : paths.filter((each) => each !== path) });
  return (
    <div class="plot-panel">
      <div class="panel-tools">
        <MemberSelect members={choices} chosen={name} choose={(next) => change({ seconds, member: next })} />
        <label>
          <span class="unseen">{t("Time shown")}</span>
          <select
            class="field"
            value={String(seconds)}
            onChange={(event) => change({ ...settings, seconds: Number(event.currentTarget.value) })}
          >
            {WINDOWS.map((each) => (
              <option key={each} value={String(each)}>
                {each} s
              </option>
            ))}
          </select>
        </label>
        <button class="button button-quiet" type="button" aria-pressed={paused} onClick={() => setPaused(!paused)}>
          {paused ? t("Go on") : t("Pause")}
        </button>
        <button class="button button-quiet" type="button" onClick={save}>
          CSV
        </button>
      </div>
      <Canvas key={key} trace={trace} labels={labels} seconds={seconds} paused={paused || object === null} />
      <div class="panel-foot">
        <FreshnessOf object={object} kind={kind} name={name} />
        <SeriesChoice available={available} chosen={paths} label={label} pick={pick} />
      </div>
    </div>
  );
}

const NOTHING = { of: "", object: null, paths: [] };

/** Apart, since it alone changes ten times a second. */
function FreshnessOf({ object, kind, name }: { object: Remote | null; kind: FeedKind | null; name: string }) {
  return <Freshness look={useFeed(object, kind, name)} isLive={object !== null} />;
}

interface SeriesChoiceProps {
  available: readonly string[];
  chosen: readonly string[];
  label: (path: string) => string;
  pick: (path: string, on: boolean) => void;
}

function SeriesChoice({ available, chosen, label, pick }: SeriesChoiceProps) {
  const [isOpen, setOpen] = useState(false);
  return (
    <details class="series-choice" onToggle={(event) => setOpen(event.currentTarget.open)}>
      <summary>{t("Series: {0}", chosen.length)}</summary>
      <ul>
        {isOpen &&
          [...new Set([...available, ...chosen])].map((path) => (
            <li key={path}>
              <label>
                <input
                  type="checkbox"
                  checked={chosen.includes(path)}
                  onChange={(event) => pick(path, event.currentTarget.checked)}
                />{" "}
                {label(path)}
              </label>
            </li>
          ))}
      </ul>
    </details>
  );
}

/** Clocks and counters tell little as lines. */
function preferred(paths: readonly string[]): readonly string[] {
  const telling = paths.filter((path) => !/(^|\.)(ts|seqno|seconds|nanoseconds|device_time)\b|flags|units/.test(path));
  return telling.length > 0 ? telling : paths;
}

interface CanvasProps {
  trace: Trace;
  labels: readonly string[];
  seconds: number;
  paused: boolean;
}

function Canvas({ trace, labels, seconds, paused }: CanvasProps) {
  const place = useRef<HTMLDivElement>(null);
  const latest = useRef({ seconds, paused });
  latest.current = { seconds, paused };
  useEffect(() => {
    const box = place.current;
    if (!box) return;
    let isZoomed = false;
    const zoomed = (): void => void (isZoomed = true);
    const zoomOut = (): void => void (isZoomed = false);
    let plot = makePlot(box, labels, zoomed);
    let [drawn, isInView] = ["", true];
    const draw = (): void => {
      if (latest.current.paused || document.hidden || !isInView) return;
      const isPointedAt = (plot.cursor.left ?? -1) >= 0;
      const next = `${trace.pushed} ${latest.current.seconds} ${isPointedAt}`;
      if (next === drawn) return;
      drawn = next;
      const data = trace.window(latest.current.seconds) as uPlot.AlignedData;
      plot.setData(data, !isZoomed);
      if (isZoomed) plot.redraw();
      if (!isPointedAt && data[0].length > 0) plot.setLegend({ idx: data[0].length - 1 }); // the newest values
    };
    const fit = new ResizeObserver(() => plot.setSize(sizeOf(box, plot)));
    fit.observe(box);
    box.addEventListener("dblclick", zoomOut);
    const look = new IntersectionObserver((seen) => (isInView = seen.at(-1)?.isIntersecting ?? true));
    look.observe(box);
    const unwatch = onColoursChanged(() => {
      plot.destroy();
      plot = makePlot(box, labels, zoomed);
      isZoomed = false;
      drawn = "";
      plot.setData(trace.window(latest.current.seconds) as uPlot.AlignedData);
    });
    const timer = setInterval(() => drawInTurn(draw), DRAW_MS);
    draw();
    return () => {
      clearInterval(timer);
      leaveTurn(draw);
      unwatch();
      box.removeEventListener("dblclick", zoomOut);
      fit.disconnect();
      look.disconnect();
      plot.destroy();
    };
  }, [trace]);
  return <div ref={place} class="plot-canvas" role="img" aria-label={t("Plot of {0}", labels.join(", "))} />;
}

function makePlot(box: HTMLElement, labels: readonly string[], zoomed: () => void): uPlot {
  const palette = readPalette(box);
  const axis = { stroke: palette.inkSoft, grid: { stroke: palette.line, width: 1 }, ticks: { stroke: palette.line } };
  const plot = new uPlot(
    {
      width: Math.max(box.clientWidth, 40),
      height: Math.max(box.clientHeight - 40, 60),
      scales: {
        x: { time: false },
        y: { range: (_, low, high) => (low === high ? [low - 1, high + 1] : uPlot.rangeNum(low, high, 0.1, true)) },
      },
      hooks: { setSelect: [({ select }) => void ((select.width > 0 || select.height > 0) && zoomed())] },
      cursor: { drag: { x: true, y: true, uni: 20 } },
      legend: { live: true },
      axes: [
        { ...axis, values: (_, ticks) => ticks.map((s) => `${s} s`) },
        { ...axis, size: 56 },
      ],
      series: [
        { label: t("Time"), value: (_, s) => (s === null ? "–" : `${s.toFixed(2)} s`) },
        ...labels.map((label, i) => ({
          label,
          stroke: palette.series[i % palette.series.length] ?? palette.accent,
          width: 1.75,
          spanGaps: false, // what was not measured is not drawn
          points: {
            show: (plot: uPlot) => plot.data[0].length < 3, // where there is no line yet
            filter: (plot: uPlot, at: number) => lonely(plot.data[at] ?? []),
          },
          value: (_: uPlot, value: number | null) => (value === null ? "–" : String(Number(value.toPrecision(6)))),
        })),
      ],
    },
    [[], ...labels.map(() => [])] as unknown as uPlot.AlignedData,
    box,
  );
  requestAnimationFrame(() => box.isConnected && plot.setSize(sizeOf(box, plot)));
  return plot;
}

function sizeOf(box: HTMLElement, plot: uPlot): { width: number; height: number } {
  const legend = plot.root.querySelector<HTMLElement>(".u-legend")?.offsetHeight ?? 0;
  return { width: Math.max(box.clientWidth, 40), height: Math.max(box.clientHeight - legend, 60) };
}
