// The board of an object: panels to arrange, kept in the address and in this browser, saved as a file, with the stop in reach.
// Layer: web/board.

import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import { t } from "../app/language";
import { formatRoute, formatStep, placeOf } from "../app/router";
import type { Route } from "../app/router";
import { useStore } from "../app/store";
import { devicesOf, isShared } from "../gateway/devices";
import type { DeviceList } from "../gateway/devices";
import { useObject } from "../live/links";
import { usePulse } from "../live/pulse";
import { KINDS } from "../panels/panel";
import type { Link } from "../robot/link";
import type { Remote } from "../robot/remote";
import type { StopCall } from "../robot/stop";
import { Failure } from "../ui/failure";
import { FileInput } from "../ui/file_input";
import { saveFile } from "../ui/save_file";
import { Silence } from "../ui/silence";
import { Definitions, scopeOf } from "../values/definitions";
import {
  formatBoard,
  isTooLong,
  keepBoard,
  makeId,
  MOST_PANELS,
  packBoard,
  PANEL_KINDS,
  parseBoard,
  recallBoard,
  sameBoard,
  unpackBoard,
} from "./board";
import type { Board, Panel, PanelKind } from "./board";
import { Guard } from "./guard";
import { Keeper } from "./keeper";
import { COLUMNS, findRoom, inOrder, MOST_COLUMNS, nudge, put, settle, spread } from "./layout";
import { nameOf, PanelFrame } from "./panel_frame";
import { presetFor, stopFor } from "./presets";
import type { Described } from "./presets";
import { StopButton, useSafe } from "./stop";
import { UndoBar, useUndo } from "./undo";
import "./board.css";
import "../panels/parts.css";

type ServiceRoute = Route & { page: "service" };

export interface BoardPageProps {
  link: Link;
  route: ServiceRoute;
  list: DeviceList;
  /** Nobody is signed in any more. */
  onlyStop: boolean;
}

export default function BoardPage({ link, route, list, onlyStop }: BoardPageProps) {
  const place = placeOf(route);
  const path = place.object;
  const key = boardKey(route);
  const { object, reach, last, failure } = useObject(link, "", path, list);
  const described = useMemo(() => last && describe(last), [last]);
  const preset = useMemo(
    () => described && presetFor({ ...described, devices: devicesOf(list.state.value)?.map(({ name }) => name) }),
    [described?.type], // once: its panels keep their ids, and with them what they show
  );
  const known = useMemo(() => described && stopFor(described), [described]); // the same type may have other members now
  const { board, isKept, trouble, setBoard: writeDown, setTrouble } = useBoard(key, route, preset);
  const undo = useUndo(`${key} ${route.board ?? ""}`);
  const grid = useRef<HTMLDivElement>(null);
  const [arranging, setArranging] = useState(false);
  const columns = useColumns();
  const silent = usePulse(object, isShared(useStore(list.state), route.device));
  const services = useServices(list);
  const safe = useSafe(route, list);
  if (!board) {
    return (
      <div class="board-page">
        <div class="board-bar">
          <StopButton object={reach} stop={null} place={route} safe={safe} />
        </div>
        {failure === null ? <Waiting /> : <Failure text={failure} />}
      </div>
    );
  }
  const stop = known ?? stopOf(board, described); // a file may say how to stop what is not known, and nothing else
  if (onlyStop) {
    return (
      <div class="board-page">
        <div class="board-bar">
          <StopButton object={reach} stop={stop} place={route} safe={safe} />
        </div>
      </div>
    );
  }
  /** As it stands on this screen; it is kept as it was arranged until somebody arranges it here. */
  const here: Board = { ...board, panels: spread(board.panels, board.columns, columns), columns };
  const setBoard = (next: Board): void => {
    if (sameBoard(board, next) || sameBoard(here, next)) return;
    if (isTooLong(next)) return setTrouble(t("The board would be too large to be kept, with what its files have."));
    undo.forget();
    writeDown(next);
    setTrouble(null);
  };
  const replace = (words: string, next: Board): void => {
    undo.lose(words, board);
    writeDown(next, next === preset);
    setTrouble(null);
  };
  const putBack = (before: Board): void => {
    undo.forget();
    writeDown(before, before === preset);
    grid.current?.focus({ preventScroll: true });
  };
  const setPanels = (panels: readonly Panel[]): void => setBoard({ ...here, panels });
  const add = (kind: PanelKind): void => {
    const { w, h } = KINDS[kind];
    const place = findRoom(here.panels, { w, h }, columns);
    setPanels([...here.panels, { id: makeId(), kind, title: "", from: "", object: "", settings: {}, ...place }]);
    setArranging(true);
  };
  const withChange = (id: string, change: Partial<Panel>): Board => ({
    ...board,
    panels: board.panels.map((panel) => (panel.id === id ? { ...panel, ...change } : panel)),
  });
  const update = (id: string, change: Partial<Panel>): void => setBoard(withChange(id, change));
  const chooseService = (panel: Panel, from: string): void => {
    const next = withChange(panel.id, { from, settings: {} });
    if (Object.keys(panel.settings).length === 0) return setBoard(next);
    replace(t("Emptied for another service: {0}", nameOf(panel)), next);
  };
  const showsTools = arranging || board.panels.length === 0; // nobody looks for the way to begin
  return (
    <div class="board-page" data-kept={isKept}>
      <div class={`board-bar ${showsTools ? "is-arranging" : ""}`}>
        <StopButton object={reach} stop={stop} place={route} safe={safe} />
        <Silence silent={silent} />
        <BoardTools
          board={board}
          name={key}
          arranging={arranging}
          isOpen={showsTools}
          setArranging={setArranging}
          add={add}
          take={(next) => replace(t("The board is that of the file."), next)}
          reset={() => preset && replace(t("The board is as at first."), preset)}
          fail={setTrouble}
        />
      </div>
      <Failure text={trouble ?? failure} />
      <div ref={grid} class="board" tabIndex={-1} style={{ "--columns": String(columns) }}>
        {inOrder(here.panels).map((panel) => (
          <Guard key={panel.id}>
            <PanelFrame
              panel={panel}
              link={link}
              place={place}
              services={services}
              list={list}
              arranging={arranging}
              move={(place) => setPanels(put(here.panels, panel.id, place, columns))}
              step={(dx, dy) => setPanels(nudge(here.panels, panel.id, dx, dy, columns))}
              update={(change) => update(panel.id, change)}
              chooseService={(from) => chooseService(panel, from)}
              remove={() => {
                const left = board.panels.filter(({ id }) => id !== panel.id);
                replace(t("Removed: {0}", nameOf(panel)), { ...board, panels: settle(left, board.columns) });
              }}
            />
          </Guard>
        ))}
      </div>
      {board.panels.length === 0 && <p class="empty">{t("This board is empty. Add a panel above.")}</p>}
      <UndoBar lost={undo.lost} undo={putBack} />
    </div>
  );
}

function describe({ type, members, definitions }: Remote): Described {
  return { type, members, definitions: new Definitions(definitions), scope: scopeOf(type) };
}

/** Not once the object is known to have nothing of it: the gateway is then to make the device safe. */
function stopOf({ stop }: Board, object: Described | null): StopCall | null {
  const isThere = object?.members.some(({ name }) => name === stop?.call || name === stop?.set?.property) ?? true;
  return isThere ? stop : null;
}

function Waiting() {
  return (
    <div class="members-loading" aria-hidden="true">
      <span class="bone" />
      <span class="bone" />
    </div>
  );
}

function boardKey({ device, service, path }: ServiceRoute): string {
  return [device, service, ...path.map(formatStep)].map(encodeURIComponent).join("/");
}

interface BoardState {
  /** Whether all changes are in the address and this browser. */
  isKept: boolean;
  board: Board | null;
  trouble: string | null;
  /** `isPreset`: it is not worth keeping. */
  setBoard: (board: Board, isPreset?: boolean) => void;
  setTrouble: (text: string | null) => void;
}

/** From the address, else from this browser, else the preset; changes go to both. */
function useBoard(key: string, route: ServiceRoute, preset: Board | null): BoardState {
  const [chosen, setChosen] = useState<{ key: string; board: Board } | null>(null);
  const [trouble, setTrouble] = useState<string | null>(null);
  const address = formatRoute(route.device, route.service, route.path, "board");
  const show = (board: Board): void => history.replaceState(null, "", `${address}&board=${packBoard(board)}`);
  useEffect(() => {
    setTrouble(null);
    let found: Board | null = null;
    if (route.board !== null) {
      try {
        found = unpackBoard(route.board);
      } catch (error) {
        setTrouble((error as Error).message);
      }
    }
    found ??= recallBoard(key);
    setChosen(found && { key, board: found });
    if (found && route.board === null) show(found);
  }, [key, route]); // each time that an address is opened, also one that the page had before it was changed here
  const keeper = useMemo(() => new Keeper(), []);
  useEffect(() => {
    const leave = (): void => keeper.flush(true);
    window.addEventListener("pagehide", leave);
    return () => {
      window.removeEventListener("pagehide", leave);
      keeper.flush(false);
    };
  }, [route, keeper]);
  const shown = chosen?.key === key ? chosen.board : preset;
  const setBoard = (board: Board, isPreset = false): void => {
    if (!isPreset && shown && sameBoard(shown, board)) return; // a finger that moves within a cell
    setChosen({ key, board });
    keeper.write({
      store: () => keepBoard(key, isPreset ? null : board),
      show: () => (isPreset ? history.replaceState(null, "", address) : show(board)),
    });
  };
  return { board: shown, isKept: useStore(keeper.isKept), trouble, setBoard, setTrouble };
}

/** By the width of the window, in CSS pixels; the same cells are then about as large on a wall as on a desk. */
const WIDER: readonly [from: number, columns: number][] = [
  [3200, MOST_COLUMNS],
  [2300, 18],
];

function useColumns(): number {
  const count = (): number => WIDER.find(([from]) => window.innerWidth >= from)?.[1] ?? COLUMNS;
  const [columns, setColumns] = useState(count);
  useEffect(() => {
    const look = (): void => setColumns(count());
    window.addEventListener("resize", look);
    return () => window.removeEventListener("resize", look);
  }, []);
  return columns;
}

/** "device/service" of all that the gateway has. */
function useServices(list: DeviceList): string[] {
  return (devicesOf(useStore(list.state)) ?? []).flatMap(({ name, services }) =>
    services.map((service) => `${encodeURIComponent(name)}/${encodeURIComponent(service.name)}`),
  );
}

interface BoardToolsProps {
  board: Board;
  name: string;
  arranging: boolean;
  /** Whether all tools are there. */
  isOpen: boolean;
  setArranging: (on: boolean) => void;
  add: (kind: PanelKind) => void;
  take: (board: Board) => void;
  reset: () => void;
  fail: (text: string) => void;
}

function BoardTools({ board, name, arranging, isOpen, setArranging, add, take, reset, fail }: BoardToolsProps) {
  const file = useRef<HTMLInputElement>(null);
  const isFull = board.panels.length >= MOST_PANELS; // a larger one could not be read again
  const [kind, setKind] = useState<PanelKind>("plot");
  const save = (): void =>
    saveFile(
      `${decodeURIComponent(name).replace(/[^\w.-]+/g, "-")}.board.json`,
      "application/json",
      formatBoard(board),
    );
  const open = (chosen: File | undefined): void => {
    if (!chosen) return;
    chosen
      .text()
      .then(
        (text) => take(parseBoard(text)),
        (error: unknown) => fail((error as Error).message),
      )
      .catch((error: unknown) => fail((error as Error).message));
  };
  return (
    <div class="board-tools">
      <button class="button" type="button" aria-pressed={arranging} onClick={() => setArranging(!arranging)}>
        {arranging ? t("Done") : t("Arrange")}
      </button>
      {isOpen && (
        <>
          <label>
            <span class="unseen">{t("Kind of panel")}</span>
            <select
              class="field"
              value={kind}
              onChange={(event) => setKind(PANEL_KINDS.find((each) => each === event.currentTarget.value) ?? "plot")}
            >
              {PANEL_KINDS.map((each) => (
                <option key={each} value={each}>
                  {t(KINDS[each].title)}
                </option>
              ))}
            </select>
          </label>
          <button class="button" type="button" disabled={isFull} onClick={() => add(kind)}>
            {t("Add panel")}
          </button>
          {isFull && <span class="note">{t("A board has at most {0} panels.", MOST_PANELS)}</span>}
          <button class="button button-quiet" type="button" onClick={save}>
            {t("Save file")}
          </button>
          <button class="button button-quiet" type="button" onClick={() => file.current?.click()}>
            {t("Open file")}
          </button>
          <button class="button button-quiet" type="button" onClick={reset}>
            {t("Reset board")}
          </button>
        </>
      )}
      <FileInput input={file} accept=".json,application/json" label={t("Board file")} open={open} />
    </div>
  );
}
