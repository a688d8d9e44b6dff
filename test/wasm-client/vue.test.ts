// rrgate-client/vue in an effect scope, which is what components have.
import { computed, effectScope } from "vue";
import "../../wasm-client/dist/node.js";
import { useCall, useDevice, useEvent, useProperty, useWire } from "../../wasm-client/dist/vue/vue.js";
import { startDevice, until, url } from "./framework_device.js";

it("follows a device until the scope ends", async () => {
  const { service, options } = await startDevice();
  const scope = effectScope();
  const sides: unknown[] = [];
  const use = () => {
    const device = useDevice(url, options);
    useEvent(device, "bump", (side) => void sides.push(side));
    const level = useWire(device, "level");
    const double = computed(() => 2 * Number(level.value.value ?? 0));
    return { device, level, double, speed: useProperty(device, "speed"), add: useCall(device, "add") };
  };
  const { device, level, double, speed, add } = scope.run(use) as ReturnType<typeof use>;
  await until(() => device.value.state.status === "connected" && speed.state.value.value === 0);
  await until(
    () => double.value === 42,
    () => device.value.client?.publish_level?.(21),
  );

  await speed.set(2.5);
  expect(speed.state.value.value).toBe(2.5);
  expect(await add.call(5)).toBe(5);
  expect(add.state.value).toEqual({ value: 5, error: undefined, isBusy: false });
  await until(
    () => sides.length > 0,
    () => device.value.client?.fire_bump?.(3),
  );
  expect(sides[0]).toBe(3);

  expect(level.value).toMatchObject({ value: 21, isConnected: true });
  service.drop("gone");
  await until(() => !level.value.isConnected);
  expect(level.value.value).toBe(21);

  scope.stop();
  await until(() => service.isClosed);
});
