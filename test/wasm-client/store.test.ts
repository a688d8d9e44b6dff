// Subscriptions as pages hold them: their state, values and events over connections, and the end of all that is held.
import type { Client, OpenTransport, RrValue, SubscriptionState } from "../../wasm-client/dist/node.js";
import { ValueStore } from "../../wasm-client/ts/store.js";
import { settle, subscribe, TestService } from "./service.js";
import type { NamedObject } from "./service.js";

const definition = `service test.store
stdver 0.10
object Root
  property double speed
  wire double both
  pipe double echo
  event moved(double x, string why)
  callback double ask(double x)
  function void fire_moved(double x, string why)
  function void publish_both(double x)
  function double ask_ask(double x)
end`;

const start = () => TestService.start({ definitions: [definition], root: "test.store.Root" });

/** One service for each connection, in turn; without one the connection is refused. */
function inTurn(...services: TestService[]): OpenTransport {
  return (to, listener) => {
    const service = services.shift();
    if (!service) throw new Error("nobody is there");
    return service.transport(to, listener);
  };
}

const follow = (transport: OpenTransport) =>
  subscribe<NamedObject>("ws://one/?service=test", { transport, firstRetry: 20, random: () => 1 });

async function until(is: () => boolean): Promise<void> {
  await vi.waitUntil(is, { interval: 1 });
}

it("tells what it is doing, to who looks and to who listens", async () => {
  const first = await start();
  const subscription = follow(inTurn(first));
  const { getSnapshot, subscribe: listen } = subscription.state;
  const heard: SubscriptionState[] = [];
  const stop = listen((state) => heard.push(state));
  expect(heard).toEqual([{ status: "connecting" }]);
  await subscription.client();
  expect(getSnapshot()).toEqual({ status: "connected" });
  expect(getSnapshot()).toBe(getSnapshot());

  const before = Date.now();
  first.drop("the cable is out");
  await until(() => heard.length >= 5);
  const [waiting, connecting, again] = heard.slice(2);
  expect(waiting).toMatchObject({ status: "waiting", reason: { message: "the cable is out" } });
  expect((waiting as { nextTry: number }).nextTry).toBeGreaterThanOrEqual(before + 20);
  expect(connecting).toMatchObject({ status: "connecting", reason: { message: "the cable is out" } });
  expect(again).toMatchObject({ status: "waiting", reason: { message: "nobody is there" } });

  stop();
  const count = heard.length;
  await subscription.close();
  expect(getSnapshot()).toEqual({ status: "closed" });
  expect(heard).toHaveLength(count);
});

it("gives a loop the newest state, until it is closed", async () => {
  const subscription = follow(inTurn(await start()));
  const seen: string[] = [];
  for await (const { status } of subscription.state) {
    seen.push(status);
    if (status === "connected") void subscription.close();
  }
  expect(seen).toEqual(["connecting", "connected", "closed"]);
});

it("leaves nobody with an older value where a listener sets another one", async () => {
  const store = new ValueStore(0);
  const first: number[] = [];
  const second: number[] = [];
  store.subscribe((value) => {
    first.push(value);
    if (value === 1) store.set(2);
  });
  store.subscribe((value) => void second.push(value));
  const loop = store[Symbol.asyncIterator]();
  await loop.next();
  store.set(1);
  store.set(Number.NaN);
  expect([first, second]).toEqual([
    [0, 1, 2, Number.NaN],
    [0, 2, Number.NaN],
  ]);
  expect(await loop.next()).toEqual({ done: false, value: Number.NaN });
});

it("says that it waits to nobody where a listener has it try again at once", async () => {
  const subscription = follow(inTurn());
  const seen: string[] = [];
  const waits: number[] = [];
  let isFirst = true;
  subscription.onWaiting((wait) => waits.push(wait));
  subscription.state.subscribe(({ status }) => {
    if (status !== "waiting" || !isFirst) return;
    isFirst = false;
    subscription.retryNow();
  });
  subscription.state.subscribe(({ status }) => void seen.push(status));
  await until(() => waits.length > 0);
  expect([seen, waits]).toEqual([["connecting", "connecting", "waiting"], [20]]);
  await subscription.close();
});

it("keeps the value of a wire as a store", async () => {
  const service = await start();
  const subscription = follow(inTurn(service));
  const wire = subscription.wire("both");
  const heard: unknown[] = [];
  wire.store.subscribe((value) => heard.push(value));
  expect(wire.store.getSnapshot()).toBeUndefined();
  const client = await subscription.client();
  await until(() => wire.isConnected);
  await client["publish_both"]!(2.5);
  await until(() => wire.value === 2.5);
  expect(wire.store.getSnapshot()).toBe(2.5);
  expect(heard.at(0)).toBeUndefined();
  expect(heard.at(-1)).toBe(2.5);
  await subscription.close();
});

it("follows an event from one connection to the next", async () => {
  const first = await start();
  const subscription = follow(inTurn(first, await start()));
  const seen: RrValue[][] = [];
  const loop = (async () => {
    for await (const occurrence of subscription.event("moved")) seen.push(occurrence);
  })();
  await (
    await subscription.client()
  )["fire_moved"]!(1, "first");
  await until(() => seen.length === 1);
  first.drop("gone");
  await until(() => subscription.defaultClient === undefined);
  await (
    await subscription.client()
  )["fire_moved"]!(2, "second");
  await until(() => seen.length === 2);
  await subscription.close();
  await loop;
  expect(seen).toEqual([
    [1, "first"],
    [2, "second"],
  ]);
});

it("answers a callback on each connection, until it is taken back", async () => {
  const first = await start();
  const subscription = follow(inTurn(first, await start()));
  const stop = subscription.callback("ask", (x) => 2 * (x as number));
  expect(await (await subscription.client())["ask_ask"]!(4)).toBe(8);
  first.drop("gone");
  await until(() => subscription.defaultClient === undefined);
  const client = await subscription.client();
  await settle();
  expect(await client["ask_ask"]!(5)).toBe(10);
  stop();
  expect(client["ask"]!.handler).toBeNull();
  await subscription.close();
});

it("says what is no event", async () => {
  const subscription = follow(inTurn(await start()));
  const event = subscription.event("speed");
  const failed: unknown[] = [];
  event.onFailed((error) => failed.push(error));
  await until(() => failed.length > 0);
  expect(String(failed[0])).toContain("speed of test.store.Root is no event");
  await subscription.close();
});

it("ends with the block that holds it", async () => {
  const service = await start();
  let client: Client<NamedObject>;
  {
    await using subscription = follow(inTurn(service));
    client = await subscription.client();
    await using connection = client["both"]!.connect();
    await connection.ready;
    await using endpoint = await client["echo"]!.connect(-1);
    expect(endpoint.isClosed).toBe(false);
  }
  expect(client.$.state).toBe("closed");
  await client[Symbol.asyncDispose]();
  expect(service.isClosed).toBe(true);
});
