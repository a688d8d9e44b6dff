// What the clients of a shared device listen to: read, kept while the gateway is away, asked for only while shown.
import { awayAfter } from "../../web/src/gateway/polled_list";
import type { Polled } from "../../web/src/gateway/polled_list";
import { readSubscriptions, subscriptionsAt } from "../../web/src/gateway/subscriptions";
import type { Subscription } from "../../web/src/gateway/subscriptions";
import { ageText } from "../../web/src/ui/words";
import { polledPage, restsWhileHidden } from "./polled";

const frames: Subscription = {
  client: "192.0.2.1:5",
  path: "Webcam.Webcams[0]",
  member: "FrameStream",
  kind: "pipe",
  delivered: 12,
  conflated: 0,
  dropped: 1,
  ageP50Ms: 0.5,
  ageP99Ms: 16.4,
};

/** As the gateway writes it. */
const written = ({ ageP50Ms, ageP99Ms, ...rest }: Subscription): object => ({
  ...rest,
  age_p50_ms: ageP50Ms,
  age_p99_ms: ageP99Ms,
});

describe("subscriptions", () => {
  it("are read by member, then client", () => {
    const other = { ...frames, client: "192.0.2.1:4" };
    const wire = { ...frames, path: "Create", member: "state", kind: "wire", conflated: 7 };
    const answer = { subscriptions: [written(frames), written(other), null, { ...written(wire), service: "Create" }] };
    expect(readSubscriptions(answer)).toEqual([wire, other, frames]);
    expect(readSubscriptions({ subscriptions: [{}] })).toMatchObject([
      { client: "", member: "", delivered: 0, ageP99Ms: 0 },
    ]);
    expect(() => readSubscriptions({ devices: [] })).toThrow('no list "subscriptions"');
  });

  it("stay as they were while the gateway is away, since when it went", () => {
    const known: Polled<Subscription> = { kind: "known", items: [frames] };
    const away = awayAfter(known, new TypeError("fetch failed"), 1000);
    expect(away).toEqual({
      kind: "away",
      since: 1000,
      reason: "the gateway cannot be reached",
      items: [frames],
    });
    expect(awayAfter(away, new Error("late"), 2000)).toMatchObject({
      since: 1000,
      reason: "late",
      items: [frames],
    });
    expect(awayAfter({ kind: "loading" }, new Error("late"), 2000)).toMatchObject({ since: 2000, items: null });
    expect(awayAfter({ kind: "denied", reason: "no" }, new Error("late"), 3)).toMatchObject({ items: null });
  });
});

describe("a list of subscriptions", () => {
  const page = polledPage();
  const { answers, asked } = page;

  it("is asked again every 3 s, and no more once it is closed", async () => {
    answers.push(Response.json({ subscriptions: [written(frames)] }), Response.json({ subscriptions: [] }));
    const list = subscriptionsAt("a b");
    list.start();
    await vi.advanceTimersByTimeAsync(0);
    expect(list.state.value).toEqual({ kind: "known", items: [frames] });
    await vi.advanceTimersByTimeAsync(3000);
    expect(list.state.value).toEqual({ kind: "known", items: [] });
    expect(asked).toEqual(Array(2).fill("https://host/robots/api/v1/devices/a%20b/subscriptions"));
    list.stop();
    await vi.advanceTimersByTimeAsync(60_000);
    expect(asked.length).toBe(2);
  });

  it("says who may not see it, and why", async () => {
    answers.push(Response.json({ detail: "vera may not" }, { status: 403 }), new Response("", { status: 401 }));
    const list = subscriptionsAt("robot");
    list.start();
    await vi.advanceTimersByTimeAsync(0);
    expect(list.state.value).toEqual({ kind: "denied", reason: "vera may not" });
    await vi.advanceTimersByTimeAsync(3000);
    expect(list.state.value).toEqual({ kind: "denied", reason: "the gateway answered 401" });
    await vi.advanceTimersByTimeAsync(3000);
    expect(list.state.value).toMatchObject({
      kind: "away",
      reason: "the gateway cannot be reached",
      items: null,
    });
    list.stop();
  });

  restsWhileHidden(page, () => subscriptionsAt("robot"));
});

it("an age has the digits that matter", () => {
  expect([0, 0.44, 12.3, 999, 1512].map(ageText)).toEqual(["0.0 ms", "0.4 ms", "12 ms", "999 ms", "1.5 s"]);
});
