// The board of an object over outages of its device.
import { clear, find, press, settle, show, text } from "./shown";
import { memberOf } from "./members";
import { Store } from "../../web/src/app/store";
import BoardPage from "../../web/src/board/board_page";
import type { BoardPageProps } from "../../web/src/board/board_page";
import type { LinkState } from "../../web/src/robot/link";
import { OwnLocks } from "../../web/src/robot/own_locks";
import type { Member, Remote } from "../../web/src/robot/remote";
import { UnderWay } from "../../web/src/robot/under_way";

afterEach(clear);

const remoteOf = (members: readonly Member[]) => ({
  type: "a.b.Robot",
  path: "Robot",
  members,
  definitions: ["service a.b\n"],
  underWay: new UnderWay(),
  locks: new OwnLocks(),
  controls: new Map(),
  onReleased: () => () => undefined,
  lease: () => Promise.reject(new Error("none")),
  ping: () => Promise.resolve(false),
  urgent: vi.fn(() => Promise.resolve<unknown>(undefined)),
});

const online = (remote: ReturnType<typeof remoteOf>): LinkState => ({
  kind: "online",
  since: 0,
  remote: remote as unknown as Remote,
});

const showBoard = (state: Store<LinkState>) =>
  show(BoardPage, {
    link: { state },
    route: { page: "service", device: "d", service: "s", path: [], view: "board", board: null },
    list: { state: new Store({ kind: "known", devices: [] }) },
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
