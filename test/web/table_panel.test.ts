// Values of members over outages of their device.
import { clear, find, show, text } from "./shown";
import { memberOf } from "./members";
import type { PanelProps } from "../../web/src/panels/panel";
import TablePanel from "../../web/src/panels/table_panel";
import type { Remote } from "../../web/src/robot/remote";
import { Definitions } from "../../web/src/values/definitions";

beforeEach(() => void vi.useFakeTimers());
afterEach(() => {
  clear();
  vi.useRealTimers();
});

test("the value of a member that the device came back without stays marked as old", async () => {
  /** Says something once, as what changes rarely. */
  const object = {
    async *wire() {
      yield 42;
      await new Promise(() => undefined);
    },
  } as unknown as Remote;
  const members = [memberOf("wire", "double", "door"), memberOf("wire", "double", "light")];
  const update = show(TablePanel, {
    object,
    members,
    definitions: new Definitions([]),
    scope: "",
    settings: { member: "door" },
    change: () => undefined,
  } as unknown as PanelProps);
  await vi.advanceTimersByTimeAsync(1_000);
  const isMarked = () => find(".panel-scroll").classList.contains("is-stale");
  expect([text().includes("42"), isMarked()]).toEqual([true, false]);
  void update({ object: null });
  await vi.advanceTimersByTimeAsync(1_000);
  expect([text().includes("42"), isMarked()]).toEqual([true, true]);
  void update({ object: { ...object }, members: members.slice(1) });
  await vi.advanceTimersByTimeAsync(1_000);
  expect([text().includes("42"), isMarked(), text().includes("Stale: 3.0 s old")]).toEqual([true, true, true]);
});
