// Numbers over time: any of some wires, properties and pipes, by their path; pause, zoom, cursor, and a file of what is shown.
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
import type { Member, Remote } from "../robot/remote";
import { unitOf } from "../values/units";
import { numberPaths, numberReader } from "../values/paths";
import { saveFile } from "../ui/save_file";
import { membersFor, numberIn } from "./panel";
import type { PanelProps } from "./panel";
import { feedKindOf, Freshness, MemberOptions, MemberSelect } from "./parts";
import { MOST_SOURCES, sharedUnit, sourcesOf, withSources } from "./plot_sources";
import type { PlotSource } from "./plot_sources";
import { lonely, measuredAt, Trace, toCsv } from "./trace";
import "./plot_panel.css";

const DRAW_MS = 100;
const LOOK_MS = 1_000;
const AT_FIRST = 4;
const WINDOWS = [10, 30, 120, 600];

/** A member of the plot, and what is known of it. */
interface Source {
  name: string;
  kind: FeedKind | null;
  available: readonly string[];
  paths: readonly string[];
  /** Its first column of the trace. */
  from: number;
}

/** The numbers that a member was found to have, by which object. */
type Found = Readonly<Record<string, { object: Remote | null; paths: readonly string[] }>>;

export default function PlotPanel(props: PanelProps) {
  const { object, members, settings, change, definitions, scope } = props;
  const choices = membersFor("plot", members);
  const seconds = numberIn(settings, "seconds", 30, 1, 3600);
  const [found, setFound] = useState<Found>({});
  const chosen = sourcesOf(settings, choices[0]?.name ?? "");
  let columns = 0;
  const sources: Source[] = chosen.map(({ member: name, paths: wanted }) => {
    const available = (Object.hasOwn(found, name) && found[name]?.paths) || [];
    const paths = wanted.length > 0 ? wanted : preferred(available).slice(0, AT_FIRST);
    const from = columns;
    columns += paths.length;
    return { name, kind: feedKindOf(choices.find((each) => each.name === name)), available, paths, from };
  });
  const key = JSON.stringify(sources.map(({ name, paths }) => [name, paths]));
  const trace = useMemo(() => new Trace(columns, sources.length), [key]);
  const [paused, setPaused] = useState(false);
  const isOne = sources.length === 1;
  const unit = useCallback(
    (name: string, path: string): string => {
      const member = members.find((each) => each.name === name);
      return unitOf(member?.type ?? "", path, definitions, scope, member);
    },
    [members, definitions, scope],
  );
  const label = useCallback(
    (name: string, path: string): string => {
      const shown = isOne ? path || name : pathIn(name, path);
      const said = unit(name, path);
      return said === "" ? shown : `${shown} [${said}]`;
    },
    [isOne, unit],
  );
  const series = sources.flatMap(({ name, paths }) => paths.map((path) => ({ name, path })));
  const labels = useMemo(() => series.map(({ name, path }) => label(name, path)), [key, label]);
  const shared = useMemo(() => sharedUnit(series.map(({ name, path }) => unit(name, path))), [key, unit]);
  const set = (next: readonly PlotSource[]): void => change(withSources(settings, next));
  const save = (): void => {
    const head = series.map(({ name, path }) => (isOne ? path || name : pathIn(name, path)));
    saveFile(`${sources.map(({ name }) => name).join("-")}.csv`, "text/csv", toCsv(["time_s", ...head], trace));
  };
  const pick = (source: Source, path: string, on: boolean): void => {
    const paths = on ? [...source.paths, path] : source.paths.filter((each) => each !== path);
    set(chosen.map((each) => (each.member === source.name ? { member: source.name, paths } : each)));
  };
  const left = choices.filter((each) => !sources.some(({ name }) => name === each.name));
  return (
    <div class="plot-panel">
      <div class="panel-tools">
        {isOne && (
          <MemberSelect
            members={choices}
            chosen={sources[0]?.name ?? ""}
            choose={(member) => set([{ member, paths: [] }])}
          />
        )}
        {!isOne &&
          sources.map(({ name }) => (
            <button
              key={name}
              class="button button-quiet plot-off"
              type="button"
              aria-label={t("Take {0} off the plot", name)}
              onClick={() => set(chosen.filter(({ member }) => member !== name))}
            >
              {name} <span aria-hidden="true">×</span>
            </button>
          ))}
        {left.length > 0 && sources.length < MOST_SOURCES && (
          <AddSelect members={left} add={(member) => set([...chosen, { member, paths: [] }])} />
        )}
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
      <Canvas
        key={`${key} ${shared}`}
        trace={trace}
        labels={labels}
        unit={shared}
        seconds={seconds}
        paused={paused || object === null}
      />
      <div class="panel-foot">
        {sources.map((source) => (
          <Follow
            key={source.name}
            object={object}
            source={source}
            trace={trace}
            isNamed={!isOne}
            find={(paths) => setFound((old) => withFound(old, source.name, object, paths))}
          />
        ))}
        <SeriesChoice sources={sources} label={label} pick={pick} />
      </div>
    </div>
  );
}

function AddSelect({ members, add }: { members: readonly Member[]; add: (name: string) => void }) {
  return (
    <label class="plot-add">
      <span class="unseen">{t("Add to the plot")}</span>
      <select
        class="field"
        value=""
        onChange={(event) => {
          add(event.currentTarget.value);
          event.currentTarget.value = "";
        }}
      >
        <option value="">{t("Add")}</option>
        <MemberOptions members={members} />
      </select>
    </label>
  );
}

interface FollowProps {
  object: Remote | null;
  source: Source;
  trace: Trace;
  /** Beside others: it says which it is. */
  isNamed: boolean;
  find: (paths: readonly string[]) => void;
}

/** Writes what comes from a member into the trace, and says how fresh it is. Apart, since that changes ten times a second. */
function Follow({ object, source, trace, isNamed, find }: FollowProps) {
  const { name, kind, paths, from } = source;
  const readers = useMemo(() => paths.map(numberReader), [JSON.stringify(paths)]);
  const looked = useRef({ object, at: -Infinity });
  useEach(object, kind, name, (value, now, isAfterGap) => {
    if (looked.current.object !== object || now - looked.current.at >= LOOK_MS) {
      looked.current = { object, at: now };
      find(numberPaths(value));
    }
    if (readers.length === 0) return;
    if (isAfterGap) trace.breakOff(from, readers.length);
    const numbers = readers.map((read) => read(value));
    trace.push(now, numbers, from, readers.length);
  });
  return (
    <>
      {isNamed && <span class="note">{name}</span>}
      <Freshness look={useFeed(object, kind, name)} isLive={object !== null} />
    </>
  );
}

interface SeriesChoiceProps {
  sources: readonly Source[];
  label: (name: string, path: string) => string;
  pick: (source: Source, path: string, on: boolean) => void;
}

function SeriesChoice({ sources, label, pick }: SeriesChoiceProps) {
  const [isOpen, setOpen] = useState(false);
  const count = sources.reduce((sum, { paths }) => sum + paths.length, 0);
  return (
    <details class="series-choice" onToggle={(event) => setOpen(event.currentTarget.open)}>
      <summary>{t("Series: {0}", count)}</summary>
      <ul>
        {isOpen &&
          sources.flatMap((source) =>
            [...new Set([...source.available, ...source.paths])].map((path) => (
              <li key={`${source.name} ${path}`}>
                <label>
                  <input
                    type="checkbox"
                    checked={source.paths.includes(path)}
                    onChange={(event) => pick(source, path, event.currentTarget.checked)}
                  />{" "}
                  {label(source.name, path)}
                </label>
              </li>
            )),
          )}
      </ul>
    </details>
  );
}

/** The same where there is nothing new: of one object the longest list, since an array may be empty at first. */
function withFound(old: Found, name: string, object: Remote | null, paths: readonly string[]): Found {
  const known = Object.hasOwn(old, name) ? old[name] : undefined;
  return known?.object === object && paths.length <= known.paths.length ? old : { ...old, [name]: { object, paths } };
}

/** `state.x`, `joints[2]`, `speed`. */
function pathIn(name: string, path: string): string {
  return path === "" || path.startsWith("[") ? `${name}${path}` : `${name}.${path}`;
}

/** Clocks, counters and the numbers of names tell little as lines. */
function preferred(paths: readonly string[]): readonly string[] {
  const telling = paths.filter(
    (path) => !/(^|\.)(ts|seqno|seconds|nanoseconds|device_time)\b|flags|units|_(mode|state)$/.test(path),
  );
  return telling.length > 0 ? telling : paths;
}

interface CanvasProps {
  trace: Trace;
  labels: readonly string[];
  /** Of all series; "" where they differ. */
  unit: string;
  seconds: number;
  paused: boolean;
}

function Canvas({ trace, labels, unit, seconds, paused }: CanvasProps) {
  const place = useRef<HTMLDivElement>(null);
  const latest = useRef({ seconds, paused });
  latest.current = { seconds, paused };
  useEffect(() => {
    const box = place.current;
    if (!box) return;
    let isZoomed = false;
    const zoomed = (): void => void (isZoomed = true);
    const zoomOut = (): void => void (isZoomed = false);
    let plot = makePlot(box, labels, unit, zoomed);
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
      const end = data[0].length - 1;
      if (!isPointedAt && end >= 0) plot.setLegend({ idxs: data.map((column) => measuredAt(column, end)) }); // the newest
    };
    // In a frame of its own: where the plot stretches its box, the observer would be told again within one, which WebKit calls an error.
    let resizing = 0;
    const fit = new ResizeObserver(() => {
      cancelAnimationFrame(resizing);
      resizing = requestAnimationFrame(() => plot.setSize(sizeOf(box, plot)));
    });
    fit.observe(box);
    box.addEventListener("dblclick", zoomOut);
    const look = new IntersectionObserver((seen) => (isInView = seen.at(-1)?.isIntersecting ?? true));
    look.observe(box);
    const unwatch = onColoursChanged(() => {
      plot.destroy();
      plot = makePlot(box, labels, unit, zoomed);
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
      cancelAnimationFrame(resizing);
      look.disconnect();
      plot.destroy();
    };
  }, [trace]);
  return (
    <div ref={place} class="plot-canvas" role="img" aria-label={t("Plot of {0}", labels.join(", "))} data-unit={unit} />
  );
}

function makePlot(box: HTMLElement, labels: readonly string[], unit: string, zoomed: () => void): uPlot {
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
      cursor: {
        drag: { x: true, y: true, uni: 20 },
        dataIdx: (plot, series, index) => measuredAt(plot.data[series] ?? [], index),
      },
      legend: { live: true },
      axes: [
        { ...axis, values: (_, ticks) => ticks.map((s) => `${s} s`) },
        { ...axis, size: 56, ...(unit !== "" && { label: unit, labelSize: 18, labelFont: "12px sans-serif" }) },
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
          value: (_: uPlot, value: number | null | undefined) =>
            typeof value === "number" ? String(Number(value.toPrecision(6))) : "–",
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
