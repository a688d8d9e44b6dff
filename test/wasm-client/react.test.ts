// rrgate-client/react in React, strict mode included: it mounts everything twice.
import { act, createElement, StrictMode, Suspense, use } from "react";
import { Window } from "happy-dom";
import "../../wasm-client/dist/node.js";
import { useCall, useDevice, useEvent, useProperty, useWire } from "../../wasm-client/dist/react/react.js";
import type { DeviceState } from "../../wasm-client/dist/react/react.js";
import { startDevice, until, url } from "./framework_device.js";

const window = new Window();
Object.assign(globalThis, { window, document: window.document, ["IS_REACT_ACT_ENVIRONMENT"]: true });
Object.assign(globalThis, "navigator" in globalThis ? {} : { navigator: window.navigator });
const { createRoot } = await import("react-dom/client"); // looks for the page when it is loaded

it("shows a device, its wires, properties, events and calls", async () => {
  const { service, options } = await startDevice();
  const sides: unknown[] = [];
  let last: ReturnType<typeof usePanel> | undefined;
  const usePanel = () => {
    const device = useDevice(url, options);
    useEvent(device, "bump", (side) => void sides.push(side));
    return {
      device,
      level: useWire(device, "level"),
      speed: useProperty(device, "speed"),
      add: useCall(device, "add"),
    };
  };
  const Panel = () => {
    last = usePanel();
    return createElement(
      "p",
      null,
      `${last.device.state.status} ${String(last.level.value)} ${String(last.speed.value)}`,
    );
  };
  const root = createRoot(document.body);
  const shows = (text: string) => act(() => until(() => document.body.textContent === text));

  act(() => root.render(createElement(StrictMode, null, createElement(Panel))));
  await shows("connected undefined 0");
  await act(() =>
    until(
      () => last?.level.value === 42,
      () => last?.device.client?.publish_level?.(42),
    ),
  );
  await shows("connected 42 0");
  await act(async () => last?.speed.set(2.5));
  await shows("connected 42 2.5");
  await act(async () => last?.add.call(5));
  expect(last?.add).toMatchObject({ value: 5, error: undefined, isBusy: false });
  await act(() =>
    until(
      () => sides.length > 0,
      () => last?.device.client?.fire_bump?.(3),
    ),
  );
  expect(sides[0]).toBe(3);

  act(() => service.drop("gone")); // there is nobody else to connect to
  await act(() => until(() => last?.level.isConnected === false));
  expect(last?.level).toMatchObject({ value: 42, isConnected: false });

  act(() => root.unmount());
  await until(() => service.isClosed);
});

it("suspends what is below until the device is first connected, which then has each client", async () => {
  const { service, options } = await startDevice();
  const { service: next } = await startDevice();
  let now = service;
  const clients = new Set<unknown>();
  let retryNow: (() => void) | undefined;
  let connect!: () => void;
  const isPlugged = new Promise<void>((resolve) => (connect = resolve));
  const urlOnceThere = async () => {
    await isPlugged;
    return url;
  };
  const Speed = ({ device }: { device: DeviceState }) => {
    use(device.ready);
    const robot = device.client; // undefined during an outage
    if (robot) clients.add(robot);
    retryNow = () => device.subscription?.retryNow();
    return createElement("p", null, robot ? robot.$.type : "away");
  };
  const Panel = () => {
    const device = useDevice(urlOnceThere, { ...options, transport: (...way) => now.transport(...way) });
    return createElement(Suspense, { fallback: device.state.status }, createElement(Speed, { device }));
  };
  const root = createRoot(document.body);
  const shows = (text: string) => act(() => until(() => document.body.textContent === text));

  await act(async () => root.render(createElement(StrictMode, null, createElement(Panel))));
  await shows("connecting");
  connect();
  await shows("test.framework.Robot");
  now = next;
  act(() => service.drop("gone"));
  await shows("away");
  act(() => retryNow?.());
  await shows("test.framework.Robot");
  expect(clients.size).toBe(2);
  act(() => root.unmount());
  await until(() => next.isClosed);
});
