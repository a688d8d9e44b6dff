// The board of an object over outages of its device.
import { button, clear, enter, find, press, settle, show, text } from "./shown";
import { memberOf } from "./members";
import { remoteOf } from "./remotes";
import { MOST_PANELS, packBoard, recallBoard } from "../../web/src/board/board";
import type { Panel } from "../../web/src/board/board";
import { Store } from "../../web/src/app/store";
import BoardPage from "../../web/src/board/board_page";
import type { BoardPageProps } from "../../web/src/board/board_page";
import type { LinkState } from "../../web/src/robot/link";
import type { Remote } from "../../web/src/robot/remote";

vi.mock("../../web/src/gateway/link_to", () => ({
  linkTo: () => ({ link: { state: new Store<LinkState>({ kind: "connecting" }) }, dispose: () => undefined }),
}));
afterEach(clear);

const online = (remote: ReturnType<typeof remoteOf>): LinkState => ({
  kind: "online",
  since: 0,
  remote: remote as unknown as Remote,
});

const showBoard = (state: Store<LinkState>, board: string | null = null) =>
  show(BoardPage, {
    link: { state },
    route: { page: "service", device: "d", service: "s", path: [], view: "board", board },
    list: {
      state: new Store({
        kind: "known",
        devices: [
          { name: "webcams", services: [{ name: "Webcam" }], safe: [] },
          { name: "d", services: [{ name: "s" }], safe: ["s.power=0"] },
        ],
      }),
    },
    onlyStop: false,
  } as unknown as BoardPageProps);

test("Stop calls what the device stops by now, also where it came back with the same type", async () => {
  const before = remoteOf([memberOf("function", "void", "halt")]);
  const state = new Store<LinkState>(online(before));
  showBoard(state);
  await settle();
  expect(text()).toContain("calls halt()");
  const panel = find("[data-panel]");
  state.value = { kind: "lost", since: 0, reason: "away", retryAt: 0, remote: null };
  await settle();
  const after = remoteOf([memberOf("function", "void", "e_stop")]);
  state.value = online(after);
  await settle();
  expect(text()).toContain("calls e_stop()");
  await press("Stop");
  expect(after.urgent).toHaveBeenCalledWith("e_stop", [], expect.anything());
  expect(before.urgent).not.toHaveBeenCalled();
  expect(find("[data-panel]")).toBe(panel); // as it was, with what it holds
});

test("a device that came back without a function that stops it is made safe by the gateway", async () => {
  const state = new Store<LinkState>(online(remoteOf([memberOf("function", "void", "halt")])));
  const update = showBoard(state);
  await settle();
  expect(text()).toContain("calls halt()");
  state.value = { kind: "lost", since: 0, reason: "away", retryAt: 0, remote: null };
  await settle();
  state.value = online(remoteOf([]));
  await update();
  expect(text()).not.toContain("halt()");
  expect(text()).toContain("lets the gateway make it safe: s.power=0");
});

test("the stop of a board's file holds where the object has that function", async () => {
  const board = packBoard({ panels: [], columns: 12, stop: { call: "freeze", args: [] } });
  const state = new Store<LinkState>(online(remoteOf([memberOf("function", "void", "freeze")])));
  const update = showBoard(state, board);
  await settle();
  expect(text()).toContain("calls freeze()");
  state.value = online(remoteOf([]));
  await update();
  expect(text()).not.toContain("freeze()");
  expect(text()).toContain("lets the gateway make it safe");
});

const panelOf = (place: Partial<Panel>): Panel => ({
  id: "",
  kind: "notes",
  title: "",
  from: "",
  object: "",
  settings: {},
  ...{ x: 0, y: 0, w: 3, h: 5, ...place },
});
const packed = (...panels: Panel[]) => packBoard({ panels, columns: 12, stop: null });

test("what another service empties in a panel comes back by Undo", async () => {
  showBoard(new Store<LinkState>(online(remoteOf([]))), packed(panelOf({ settings: { text: "call Vera" } })));
  await settle();
  await press("Arrange");
  const notes = () => recallBoard("d/s")?.panels.map(({ from, settings }) => [from, settings]);
  await enter(find<HTMLSelectElement>(".panel-source select"), "webcams/Webcam");
  expect(text()).toContain("Emptied for another service: Notes");
  await vi.waitFor(() => expect(notes()).toEqual([["webcams/Webcam", {}]]));
  await press("Undo");
  await vi.waitFor(() => expect(notes()).toEqual([["", { text: "call Vera" }]]));
});

test("no panel is added to a board that could not be read again with it", async () => {
  const panels = Array.from({ length: MOST_PANELS - 1 }, (_, i) => panelOf({ y: 5 * i }));
  showBoard(new Store<LinkState>(online(remoteOf([]))), packed(...panels));
  await settle();
  await press("Arrange");
  await press("Add panel");
  await press("Add panel");
  expect(document.querySelectorAll("[data-panel]")).toHaveLength(MOST_PANELS);
  expect(button("Add panel").disabled).toBe(true);
  expect(text()).toContain("A board has at most 64 panels.");
  expect(recallBoard("d/s")?.panels).toHaveLength(MOST_PANELS);
});

test("what would make a board too large to be kept is not taken, with the reason, until there is room again", async () => {
  const filled = { text: "x".repeat(1024 * 1024 - 1000) };
  showBoard(new Store<LinkState>(online(remoteOf([]))), packed(panelOf({ settings: filled }), panelOf({ x: 3 })));
  await settle();
  await vi.waitFor(() => expect(document.querySelectorAll("textarea")).toHaveLength(2));
  const [, notes] = document.querySelectorAll("textarea") as unknown as HTMLInputElement[];
  const note = () => recallBoard("d/s")?.panels[1]?.settings;
  await enter(notes as HTMLInputElement, "y".repeat(1000));
  expect(text()).toContain("The board would be too large to be kept");
  expect([notes?.value, note()]).toEqual(["", {}]);
  await enter(notes as HTMLInputElement, "call Vera");
  expect(text()).not.toContain("too large");
  await vi.waitFor(() => expect(note()).toEqual({ text: "call Vera" }));
});
