// What the panel of streams tells of this page's own values, beside what all clients lost.
import { clear, settle, show, text } from "./shown";
import { openFeed } from "../../web/src/live/feed";
import StreamsPanel from "../../web/src/panels/streams_panel";
import type { PanelProps } from "../../web/src/panels/panel";
import type { Account, Remote } from "../../web/src/robot/remote";

beforeEach(() => {
  const subscriptions = [1, 2].map((conflated) => ({
    client: "c",
    path: "s",
    member: "state",
    kind: "wire",
    conflated,
  }));
  vi.stubGlobal("fetch", () => Promise.resolve(new Response(JSON.stringify({ subscriptions }))));
});
afterEach(() => {
  clear();
  vi.unstubAllGlobals();
});

/** An object whose wire is open, and says nothing. */
const objectOf = (account: Account, of: Partial<Remote> = {}): Remote => {
  const wire = async function* (_: string, signal: AbortSignal, opened?: (account: Account) => void) {
    opened?.(account);
    await new Promise((resolve) => signal.addEventListener("abort", resolve));
  };
  return { wire, device: "d", path: "s", ...of } as unknown as Remote;
};

test("values of this page that were lost, and how long others waited, stand beside the sum of all clients", async () => {
  const losses = { delivered: 90, conflated: 7, dropped: 1, ageP50: 2, ageP99: 14 };
  const object = objectOf({ losses: () => Promise.resolve(losses) });
  const { close } = openFeed(object, "wire", "state");
  const place = { device: "d", service: "s", object: "" };
  const update = show(StreamsPanel, { place } as PanelProps);
  await settle();
  await update();
  expect(text()).toContain("2 ms, 99 % 14 ms");
  expect(text()).toContain("8 here, 3 for all clients");
  close();
});

test("where no account is kept of them, none is told", async () => {
  const { close } = openFeed(objectOf({ losses: () => Promise.reject(new Error("no")) }), "wire", "other");
  const update = show(StreamsPanel, { place: { device: "d", service: "s", object: "" } } as PanelProps);
  await settle();
  await update();
  expect(text()).toContain("other");
  expect(text()).not.toContain("here");
  close();
});

test("what all clients lost is told only of the object that lost it, also of another service of the device", async () => {
  const none = { losses: () => Promise.reject(new Error("no")) };
  const [root, child, other] = [objectOf(none), objectOf(none, { path: "s.arms[0]" }), objectOf(none, { device: "e" })];
  const feeds = [root, child, other].map((object) => openFeed(object, "wire", "state"));
  const object = objectOf(none, { path: "t", controls: new Map() }); // by a connection of its own
  const update = show(StreamsPanel, { object, place: { device: "d", service: "t", object: "" } } as PanelProps);
  await settle();
  await update();
  const rows = [...document.querySelectorAll("tbody tr")].map((row) =>
    [row.querySelector("th"), row.lastElementChild].map((cell) => cell?.textContent),
  );
  expect(rows).toEqual([
    ["state wire, s", "3 for all clients"],
    ["state wire, s.arms[0]", "–"],
    ["state wire, s", "–"],
  ]);
  for (const { close } of feeds) close();
});
