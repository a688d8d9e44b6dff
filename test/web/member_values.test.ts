// Panels of one member among several: nothing of one is shown under the name of another.
import { memberOf } from "./members";
import { button, clear, find, press, settle, show, text } from "./shown";
import ImagePanel from "../../web/src/panels/image_panel";
import MemoryPanel from "../../web/src/panels/memory_panel";
import type { PanelProps } from "../../web/src/panels/panel";
import TablePanel from "../../web/src/panels/table_panel";
import type { Member, Remote } from "../../web/src/robot/remote";
import { Definitions } from "../../web/src/values/definitions";

beforeEach(() => void vi.useFakeTimers({ toFake: ["setInterval", "clearInterval", "performance"] }));
afterEach(() => {
  clear();
  vi.useRealTimers();
});

const propsOf = (object: object, members: readonly Member[]): PanelProps =>
  ({
    object: object as Remote,
    members,
    definitions: new Definitions([]),
    scope: "",
    place: { device: "d", service: "s", object: "" },
    settings: { member: "a" },
    change: () => undefined,
  }) as unknown as PanelProps;

const ofB = { settings: { member: "b" } };
const picture = { width: 2, height: 1, encoding: "mono8", data: Uint8Array.of(1, 2) };

/** The tools look at what came ten times a second. */
async function look(): Promise<void> {
  vi.advanceTimersByTime(100);
  await settle();
}

test("the value of a member is not shown as that of another one without connection", async () => {
  const wire = async function* (name: string): AsyncGenerator<unknown, void> {
    yield name === "a" ? 12.5 : 0;
    await new Promise(() => undefined);
  };
  const update = show(
    TablePanel,
    propsOf({ wire }, [memberOf("wire", "double", "a"), memberOf("wire", "double", "b")]),
  );
  await settle();
  await look();
  expect(text()).toContain("12.5");
  await update({ object: null });
  await look();
  expect(text()).toContain("12.5");
  await update(ofB);
  await look();
  expect(text()).not.toContain("12.5");
});

test("the value of a member that equals that of the one before is shown", async () => {
  const wire = async function* (): AsyncGenerator<unknown, void> {
    yield false;
    await new Promise(() => undefined);
  };
  const members = [memberOf("wire", "bool", "a"), memberOf("wire", "bool", "b")];
  const update = show(TablePanel, propsOf({ wire }, members));
  await settle();
  await look();
  expect(text()).toContain("false");
  await update(ofB);
  await settle();
  await look();
  await look();
  expect(text()).toContain("false");
});

test("a picture that is taken of one camera is not shown as that of another one", async () => {
  let taken = (_: unknown): void => undefined;
  const call = () => new Promise((resolve) => (taken = resolve));
  const members = [memberOf("function", "Image", "a"), memberOf("function", "Image", "b")];
  const update = show(ImagePanel, propsOf({ call }, members));
  await settle();
  await press("Take");
  await update(ofB);
  taken(picture);
  await settle();
  expect(text()).not.toContain("2 × 1");
  expect(button("PNG").disabled).toBe(true);
  await press("Take");
  taken(picture);
  await settle();
  expect(text()).toContain("2 × 1");
});

test("items of a memory are not shown as those of another one", async () => {
  let read = (_: unknown): void => undefined;
  const object = {
    dimensions: (name: string) => Promise.resolve([name === "a" ? 4 : 2]),
    read: () => new Promise((resolve) => (read = resolve)),
  };
  const members = [memberOf("memory", "uint8[]", "a"), memberOf("memory", "uint8[]", "b")];
  const update = show(MemoryPanel, propsOf(object, members));
  await settle();
  expect(text()).toContain("4 items");
  await press("Read");
  await update(ofB);
  read(Uint8Array.of(1, 2, 3, 4));
  await settle();
  expect(document.querySelector("[data-memory]")).toBeNull();
  expect(text()).toContain("2 items");
  await press("Read");
  read(Uint8Array.of(5, 6));
  await settle();
  expect(find("[data-memory]").textContent).toContain("05 06");
});

test("a camera that streams is not asked to begin", async () => {
  let give = (): void => undefined;
  const pipe = async function* (): AsyncGenerator<unknown, void> {
    for (;;) {
      await new Promise<void>((resolve) => (give = resolve));
      yield picture;
    }
  };
  const members = [memberOf("pipe", "Image", "a"), memberOf("function", "void", "StartStreaming")];
  show(ImagePanel, propsOf({ pipe }, members));
  await settle();
  expect(button("Start stream").disabled).toBe(false);
  for (let frame = 0; frame < 25; ++frame) {
    give();
    await settle();
    await look();
  }
  expect(text()).not.toContain("Start stream");
  for (let tenth = 0; tenth < 10; ++tenth) await look();
  expect(button("Start stream").disabled).toBe(false);
});
