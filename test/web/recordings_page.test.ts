// The rows of recordings as they are shown.
import { Store } from "../../web/src/app/store";
import { RecordingsPage } from "../../web/src/pages/recordings_page";
import { button, clear, press, settle, show } from "./shown";

afterEach(clear);

const recording = {
  name: "r1",
  device: "arm",
  service: "robot",
  state: "ended",
  standing: false,
  problem: "",
  beginMs: 0,
  seconds: 1,
  bytes: 10,
  files: [],
  replay: "",
};

test("a recording is not deleted by a second click where the first one was", async () => {
  const desk = {
    state: new Store({ enabled: true, bytes: 10, maxBytes: 100, list: [recording] }),
    trouble: new Store(null),
    start: () => undefined,
    stop: () => undefined,
    remove: vi.fn(() => Promise.resolve()),
  };
  show(RecordingsPage, { desk, list: { state: new Store({ kind: "loading" }) } } as never);
  await settle();
  const placeOf = (name: string) => [...(button(name).parentElement?.children ?? [])].indexOf(button(name));
  const place = placeOf("Delete");
  await press("Delete");
  expect(placeOf("Keep it")).toBe(place);
  expect(document.activeElement).toBe(button("Keep it"));
  await press("Keep it");
  expect(document.activeElement).toBe(button("Delete"));
  await press("Delete");
  expect(desk.remove).not.toHaveBeenCalled();
  await press("Delete it for good");
  expect(desk.remove).toHaveBeenCalledWith(recording);
});

test("a recording is played as a whole, shown and ended, unless four are played already", async () => {
  const files = ["a.mcap", "a-2.mcap"].map((name) => ({ name, bytes: 1 }));
  const list = (playing: number) =>
    [1, 2, 3, 4, 5].map((number) => ({
      ...recording,
      ...{ name: `r${number}`, files, replay: number <= playing ? `replay~r${number}` : "" },
    }));
  const state = (playing: number) => ({ enabled: true, bytes: 10, maxBytes: 100, list: list(playing) });
  const desk = {
    state: new Store(state(4)),
    trouble: new Store(null),
    start: () => undefined,
    stop: () => undefined,
    play: vi.fn(() => Promise.resolve()),
    endPlaying: vi.fn(() => Promise.resolve()),
  };
  show(RecordingsPage, { desk, list: { state: new Store({ kind: "loading" }) } } as never);
  await settle();
  expect(button("Play").disabled).toBe(true); // that of the fifth, and one for both of its files
  expect(button("Play").title).toBe("4 recordings are played already; stop one of them first");
  const link = [...document.querySelectorAll("a")].find((each) => each.textContent === "Show the recording");
  expect(link?.getAttribute("href")).toBe("#/devices/replay~r1/robot");
  desk.state.value = { ...state(1), list: list(1).slice(0, 2) };
  await settle();
  await press("Play");
  expect(desk.play).toHaveBeenCalledWith(list(1)[1]);
  await press("Stop playing");
  expect(desk.endPlaying).toHaveBeenCalledWith(list(1)[0]);
});

test("a recording whose playing has not begun yet is not played again", async () => {
  const file = { name: "r1.mcap", bytes: 1 };
  let begun = (): void => undefined;
  const desk = {
    state: new Store({ enabled: true, bytes: 10, maxBytes: 100, list: [{ ...recording, files: [file] }] }),
    trouble: new Store(null),
    start: () => undefined,
    stop: () => undefined,
    play: vi.fn(() => new Promise<void>((resolve) => (begun = resolve))),
  };
  show(RecordingsPage, { desk, list: { state: new Store({ kind: "loading" }) } } as never);
  await settle();
  await press("Play");
  expect(button("Play").disabled).toBe(true);
  begun();
  await settle();
  expect(button("Play").disabled).toBe(false);
  expect(desk.play).toHaveBeenCalledTimes(1);
});

test("a replay is not offered for recording", async () => {
  const devices = ["arm", "replay~arm.robot.20261125T083000123Z"].map((name) => ({
    name,
    services: [{ name: "robot", type: "" }],
  }));
  const desk = {
    state: new Store({ enabled: true, bytes: 10, maxBytes: 100, list: [] }),
    trouble: new Store(null),
    start: () => undefined,
    stop: () => undefined,
  };
  show(RecordingsPage, { desk, list: { state: new Store({ kind: "known", devices }) } } as never);
  await settle();
  expect([...document.querySelectorAll("option")].map((each) => each.value)).toEqual(["arm/robot"]);
});
