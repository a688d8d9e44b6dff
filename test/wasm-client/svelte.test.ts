// rrgate-client/svelte with Svelte's own stores: one that derives from ours, and get().
import { derived, get } from "svelte/store";
import { ErrorCode, subscribe, type OpenTransport } from "../../wasm-client/dist/node.js";
import { callStore, deviceStore, listen, propertyStore, wireStore } from "../../wasm-client/dist/svelte/svelte.js";
import type { MemberState } from "../../wasm-client/dist/svelte/svelte.js";
import { startDevice, until, url } from "./framework_device.js";

it("shows a device while somebody looks at it", async () => {
  const { service, options } = await startDevice();
  const device = deviceStore(url, options);
  const status = derived(device, ({ state }) => state.status);
  const seen: string[] = [];
  const stop = status.subscribe((now) => void seen.push(now));
  await until(() => seen.includes("connected"));
  const { subscription } = get(device);
  expect(subscription?.isClosed).toBe(false);
  stop();
  await until(() => subscription?.isClosed === true);
  expect(get(device).client).toBeUndefined();
  expect(service.isClosed).toBe(true);
});

it("tells who waits for a device that is given up before it was there", async () => {
  const { options } = await startDevice();
  const never = () => new Promise<string>(() => undefined);
  const giveUp = new AbortController();
  const [ended, left] = [{ ...options, signal: giveUp.signal }, options].map((each) => deviceStore(never, each));
  const stop = ended!.subscribe(() => undefined);
  const { ready } = get(ended!);
  giveUp.abort();
  await expect(ready).rejects.toMatchObject({ code: ErrorCode.InvalidOperation });
  stop();
  const leave = left!.subscribe(() => undefined);
  const waiting = get(left!).ready;
  leave();
  await expect(waiting).rejects.toMatchObject({ code: ErrorCode.InvalidOperation });
});

it("follows wires, properties, events and calls", async () => {
  const { options } = await startDevice();
  const device = deviceStore(url, options);
  const stops = [device.subscribe(() => undefined)];
  await until(() => get(device).client !== undefined);
  const { subscription, client } = get(device);

  const level = wireStore(subscription, "level");
  const double = derived(level, ({ value }) => 2 * Number(value ?? 0));
  let shown = 0;
  stops.push(double.subscribe((value) => void (shown = value)));
  await until(
    () => shown === 42,
    () => client?.publish_level?.(21),
  );

  const speed = propertyStore(subscription, "speed");
  let state: { value: unknown; error: unknown; isBusy: boolean } | undefined;
  stops.push(speed.subscribe((now) => void (state = now)));
  await until(() => state?.value === 0);
  await speed.set(2.5);
  expect(state).toEqual({ value: 2.5, error: undefined, isBusy: false });

  const sides: unknown[] = [];
  stops.push(listen(subscription, "bump", (side) => void sides.push(side)));
  await until(
    () => sides.length > 0,
    () => client?.fire_bump?.(1),
  );
  expect(sides[0]).toBe(1);

  const add = callStore(subscription, "add");
  expect(await add.call(5)).toBe(5);
  expect(get(add)).toEqual({ value: 5, error: undefined, isBusy: false });
  const fail = callStore(subscription, "fail");
  await expect(fail.call("RobotRaconteur.OperationFailed", "stuck")).rejects.toThrow("stuck");
  expect(get(fail).error).toMatchObject({ message: "stuck" });
  stops.forEach((stop) => stop());
});

it("reads a property again when the read before is answered, and says that a frozen device gives none", async () => {
  vi.useFakeTimers();
  try {
    const answers: { give: (value: number) => void; fail: (error: Error) => void }[] = [];
    const read = () => new Promise<number>((give, fail) => answers.push({ give, fail }));
    const never = () => () => undefined;
    const device = { onConnected: never, onLost: never, defaultClient: { $: { member: () => ({ get: read }) } } };
    const speed = propertyStore(device as never, "speed", { every: 100 });
    const stop = speed.subscribe(() => undefined);
    await vi.advanceTimersByTimeAsync(250);
    answers[0]?.give(1);
    await vi.advanceTimersByTimeAsync(1);
    expect(get(speed)).toEqual({ value: 1, error: undefined, isBusy: false });
    await vi.advanceTimersByTimeAsync(1_000);
    expect(answers).toHaveLength(2);
    answers[1]?.fail(new Error("no answer"));
    await vi.advanceTimersByTimeAsync(1);
    expect(get(speed)).toEqual({ value: 1, error: new Error("no answer"), isBusy: false });
    stop();
  } finally {
    vi.useRealTimers();
  }
});

it("keeps what a wire gave when the connection is lost, and says how old it is and that nothing comes", async () => {
  const { service, options } = await startDevice();
  const device = subscribe(url, options);
  const client = await device.client();
  const level = wireStore(device, "level");
  const seen: boolean[] = [];
  const stop = level.subscribe(({ isConnected }) => void seen.push(isConnected));
  expect(get(level)).toEqual({ value: undefined, time: undefined, receivedAt: undefined, isConnected: false });
  await until(() => get(level).isConnected);
  expect(get(level).value).toBeUndefined();
  const before = Date.now();
  await client["publish_level"]!(21);
  await until(() => get(level).value === 21);
  const { receivedAt, time } = get(level);
  expect(receivedAt).toBeGreaterThanOrEqual(before);
  expect(time?.seconds).toBeGreaterThanOrEqual(0);
  service.drop("gone");
  await until(() => !get(level).isConnected);
  expect(get(level)).toEqual({ value: 21, time, receivedAt, isConnected: false });
  stop();
  await device.close();
});

it("says of a property that is shown again during an outage that it is not read", async () => {
  const { service, options } = await startDevice();
  const device = subscribe(url, options);
  await device.client();
  const speed = propertyStore(device, "speed");
  const shown = speed.subscribe(() => undefined);
  await until(() => get(speed).value === 0 && !get(speed).isBusy);
  shown();
  service.drop("gone");
  await until(() => device.defaultClient === undefined);
  const again = speed.subscribe(() => undefined);
  expect(get(speed)).toMatchObject({ value: 0, error: { message: expect.any(String) as string }, isBusy: false });
  again();
  await device.close();
});

it("says that a property is not read while the connection is lost", async () => {
  const [first, second] = [await startDevice(), await startDevice()];
  const services = [first.service, second.service];
  const transport: OpenTransport = (to, listener) => services.shift()!.transport(to, listener);
  const device = subscribe(url, { transport, firstRetry: 1 });
  await device.client();
  const speed = propertyStore(device, "speed", { every: 5 });
  const seen: MemberState<unknown>[] = [];
  const stop = speed.subscribe((state) => void seen.push(state));
  await until(() => get(speed).value === 0 && !get(speed).isBusy);
  let lost: MemberState<unknown> | undefined;
  device.onLost(() => (lost = get(speed)));
  first.service.drop("the cable is out");
  await until(() => lost !== undefined);
  expect(lost).toMatchObject({ value: 0, error: { message: "the cable is out" } });
  await until(() => get(speed).error === undefined && !get(speed).isBusy);
  expect(get(speed)).toEqual({ value: 0, error: undefined, isBusy: false });
  stop();
  await device.close();
});

it("gives the same store again, with what it knows, while the device is the same", async () => {
  const { options } = await startDevice();
  const device = subscribe(url, options);
  const other = subscribe(url, (await startDevice()).options);
  expect(wireStore(device, "level")).toBe(wireStore(device, "level", {}));
  expect(wireStore(device, "level")).not.toBe(wireStore(other, "level"));
  expect(wireStore(device, "level")).not.toBe(wireStore(device, "level", { path: "*.arm" }));
  expect(propertyStore(device, "speed", { every: 100 })).toBe(propertyStore(device, "speed", { every: 100 }));
  expect(propertyStore(device, "speed", { every: 100 })).not.toBe(propertyStore(device, "speed"));
  await device.client();
  await expect(callStore(device, "fail").call("RobotRaconteur.OperationFailed", "stuck")).rejects.toThrow("stuck");
  expect(get(callStore(device, "fail")).error).toMatchObject({ message: "stuck" });
  await expect(callStore(undefined, "fail").call()).rejects.toThrow("not connected");
  expect(get(callStore(undefined, "fail")).error).toBeUndefined();
  await Promise.all([device.close(), other.close()]);
});

it("says of a subscription that is closed that nothing comes", async () => {
  const { options } = await startDevice();
  const device = subscribe(url, options);
  const level = wireStore(device, "level");
  const stop = level.subscribe(() => undefined);
  await until(() => get(level).isConnected);
  await device.close();
  expect(get(level).isConnected).toBe(false);
  stop();
});

it("says that there is no connection instead of waiting for one", async () => {
  await expect(callStore(undefined, "add").call(5)).rejects.toThrow("add: is not connected");
  await expect(propertyStore(undefined, "speed").set(5)).rejects.toThrow("speed: is not connected");
});
