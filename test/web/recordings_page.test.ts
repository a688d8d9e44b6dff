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
