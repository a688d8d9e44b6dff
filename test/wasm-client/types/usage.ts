// What programs do with generated types. Compiled, never run: each line marked as an error must be one.
import { connect, lease, listUsbDevices, requestUsbDevice, rrValue, subscribe } from "rrgate-client";
import type { Complex, FunctionMember, RemoteObject, RrValue, SubscriptionState } from "rrgate-client";
import * as react from "rrgate-client/react";
import * as svelte from "rrgate-client/svelte";
import * as vue from "rrgate-client/vue";
import type { SensorPacket, SimulatedCreate } from "generated/create.js";
import type * as declared from "generated/interop.js";
import { Color } from "generated/interop_module.js";
import * as words from "generated/words_module.js";

/** Compiles where A and B are the same type. */
function same<A, B>(_same: (<T>() => T extends A ? 1 : 2) extends <T>() => T extends B ? 1 : 2 ? true : false): void {}

/** Objects of generated types, and those that are asked for by name. */
export async function hold(): Promise<void> {
  const robot = await connect<SimulatedCreate>("ws://localhost/?service=Create");
  await using held = await lease(robot, { deadman: 300 });
  await using other = await lease(await connect("ws://localhost/?service=any"));
  // @ts-expect-error no object of a service
  await lease({});
  void [held, other];
}

export async function plugIn(): Promise<string[]> {
  same<Awaited<ReturnType<typeof requestUsbDevice>>["url"], string>(true);
  const said: string[] = [];
  for (const { nodeName, url, error } of await listUsbDevices()) said.push(nodeName, url ?? error.message);
  return said;
}

export async function drive(): Promise<number> {
  const robot = await connect<SimulatedCreate>("ws://localhost/?service=Create");
  await robot.Drive(100, 5000);
  await robot.Drive(100, 5000, { timeout: 100 });
  // @ts-expect-error a number is missing
  await robot.Drive(100);
  // @ts-expect-error not a number
  await robot.Drive("fast", 5000);
  // @ts-expect-error there is no such member
  await robot.Fly();
  // @ts-expect-error readonly
  await robot.DistanceTraveled.set(3);
  robot.Bump.on(() => robot.reset());
  for await (const packet of robot.packets.connect()) return packet?.Data.byteLength ?? 0;
  // @ts-expect-error readonly
  await robot.packets.poke(null);
  robot.play_callback.handler = (distance, angle) => new Uint8Array([distance, angle]);
  robot.play_callback.handler = null;
  // @ts-expect-error the callback answers bytes
  robot.play_callback.handler = () => "song";
  await robot.$.close();
  return robot.DistanceTraveled.get();
}

export async function values(): Promise<void> {
  const interop = await connect<declared.Interop>("ws://localhost/?service=interop");
  same<Awaited<ReturnType<typeof interop.p_double.get>>, number>(true);
  same<Awaited<ReturnType<typeof interop.p_uint64.get>>, bigint>(true);
  same<Awaited<ReturnType<typeof interop.p_cdouble.get>>, Complex>(true);
  same<Awaited<ReturnType<typeof interop.p_pose_map.get>>, Map<string, declared.Pose | null> | null>(true);
  same<Awaited<ReturnType<typeof interop.p_any.get>>, RrValue>(true);
  // @ts-expect-error these are not the same
  same<Awaited<ReturnType<typeof interop.p_int8s.get>>, Uint8Array>(true);
  await interop.p_any.set(rrValue("int16[]", [1, 2]));
  await interop.p_any.set([1, "two"]);
  const pose = await interop.shift({ px: 1, py: 2, label: "here" }, 1, 1);
  // @ts-expect-error a structure may be null
  pose.px;
  // @ts-expect-error a field is missing
  await interop.p_pose.set({ px: 1, py: 2 });
  const part: declared.Part = await interop.parts.get(3);
  await part.inner.get();
  same<typeof part.$.type, string>(true);
  const other: RemoteObject = await interop.anything.get();
  await interop.named.get(other.$.path);
  // @ts-expect-error the index is a number
  await interop.parts.get("left");
  interop.changed.on((value, why) => why.repeat(value));
  await interop.p_color.set(Color.green);
  await interop.p_color.set(77);
  await interop.p_color.set("green");
  // @ts-expect-error not a value of the enum, and not a number
  await interop.p_color.set("mauve");
  same<Awaited<ReturnType<typeof interop.p_color.get>>, declared.Color>(true);
  same<typeof Color.blue, -3>(true);
  try {
    await interop.fail("custom", "text");
  } catch (error) {
    if ((error as declared.InteropError).name === "experimental.interop.InteropError") throw error;
  }
}

export async function every_kind(): Promise<void> {
  const object = await connect<words.Object_>("ws://localhost/?service=words");
  same<words.test_words_more_delete, { text: string }>(true);
  same<typeof words.largest, 9223372036854775807n>(true);
  same<typeof words.test_words_delete, "test.words.delete">(true);
  const three: readonly number[] = words.three;
  const text: string = words.both.first + words.interface_.pair.b;
  for await (const number of object.count(three.length)) same<typeof number, number>(true);
  const lines = object.collect();
  await lines.next(text);
  // @ts-expect-error lines are strings
  await lines.next(5);
  const sums = object.both_ways(1);
  const first = await sums.next(2);
  if (!first.done) same<typeof first.value, number>(true);
  const endpoint = await object.samples.connect();
  for await (const samples of endpoint) await endpoint.send(samples.subarray(1));
  for await (const frame of await object.frames.connect(3)) frame?.children?.at(0);
  await (await object.commands.connect()).send(rrValue("int8", 1));
  object.ask.handler = async (question, how) => question.length + how;
  const block = await object.image.read([0, 0], [2, 2]);
  same<typeof block.data, Uint8Array>(true);
  same<Awaited<ReturnType<typeof object.image.dimensions>>, number[]>(true);
  // @ts-expect-error readonly
  await object.image.write([0, 0], block);
  await object.numbers.write([3], new Float64Array(3));
  const next: words.switch_ | null = await object.constructor(
    { ...((await object.switch_value.get()) as words.switch_) },
    5,
  );
  next?.next?.next?.pod_grid.data.at(0)?.corners.at(0)?.static.at(0);
  // @ts-expect-error JavaScript would take the object for a promise
  object.then;
  await object.$.member("then")(5);
  await object.$.member("toString")();
  await object.operator(1, "", words.enumeration.private);
}

export async function follow(): Promise<void> {
  await using robot = subscribe<SimulatedCreate>("ws://localhost/?service=Create");
  const packets = robot.wire("packets");
  for await (const packet of packets) packet?.Data.byteLength;
  packets.store.subscribe((packet) => packet?.Data.byteLength);
  const bumps = robot.event("Bump");
  same<typeof bumps extends AsyncIterable<infer A> ? A : never, []>(true);
  robot.callback("play_callback", (distance, angle) => new Uint8Array([distance, angle]));
  // @ts-expect-error the callback answers bytes
  robot.callback("play_callback", () => "song");
  // @ts-expect-error a function is no wire
  robot.wire("Drive");
  // @ts-expect-error there is no such member
  robot.wire("paket");
  // @ts-expect-error a wire is no event
  robot.event("packets");
  // @ts-expect-error a wire is no pipe
  robot.pipe("packets");
  const far: RrValue | undefined = robot.wire("level", { path: "*.part" }).value;
  const state: SubscriptionState = robot.state.getSnapshot();
  if (state.status === "waiting") same<typeof state.nextTry, number>(true);

  await using interop = subscribe<words.Object_>("ws://localhost/?service=words");
  for await (const samples of interop.pipe("samples")) samples.subarray(1);

  const dynamic = subscribe("ws://localhost/?service=any");
  for await (const value of dynamic.wire("anything")) same<typeof value, RrValue>(true);
  for await (const given of dynamic.event("anything")) same<typeof given, RrValue[]>(true);
  await dynamic.close();
  // Every name may be a member where none is known.
  const any = await connect("ws://localhost/?service=any");
  await any.Drive(1, 2);
  await any.level.set(await any.level.get());
  any.Bump.on(() => any.$.urgent.Drive(0, 0));
  any.ask.handler = () => 5;
  const arm: RemoteObject = await any.arms.get("left");
  for await (const value of arm.state.connect()) await (await arm.commands.connect()).send(value);
  for await (const number of arm.count(3)) void number;
  const later = await subscribe("ws://localhost/?service=any").client();
  await later.Drive(1, 2, { timeout: 100 });
  // Members that are known by name need no "!" and no "?.".
  const named = await connect<RemoteObject<"Drive" | "Bump">>("ws://localhost/?service=any");
  await named.Drive(1, 2);
  for await (const given of named.Bump) same<typeof given, RrValue[]>(true);
  // @ts-expect-error not one of them
  named.Fly;
  await named.$.urgent.Drive(0, 0);
  // @ts-expect-error not one of them
  await named.$.urgent.Fly();
  const { constants, enums } = await named.$.definition();
  const limit: RrValue | undefined = constants.LIMIT;
  const run: number | undefined = enums.Mode?.run;
  void [limit, run];
  void far;
}

/** Stops, and what a definition says, by the names that there are. */
export async function stop(): Promise<void> {
  const robot = await connect<SimulatedCreate>("ws://localhost/?service=Create");
  await robot.$.urgent.Drive(0, 0, { timeout: 100 });
  // @ts-expect-error misspelt
  await robot.$.urgent.Drve(0, 0);
  // @ts-expect-error a number is missing
  await robot.$.urgent.Drive(0);
  // @ts-expect-error an event is no command
  robot.$.urgent.Bump;
  // @ts-expect-error a readonly property is no command
  robot.$.urgent.DistanceTraveled;
  const { DRIVE_STRAIGHT } = await robot.$.constants;
  same<typeof DRIVE_STRAIGHT, number>(true);
  // @ts-expect-error misspelt
  (await robot.$.constants).DRIVE_STRIGHT;

  const object = await connect<words.Object_>("ws://localhost/?service=words");
  const constants = await object.$.constants;
  same<typeof constants.largest, bigint>(true);
  same<typeof constants.three, Int16Array>(true);
  same<typeof constants.both.second.third, number>(true);

  const interop = await connect<declared.Interop>("ws://localhost/?service=interop");
  await interop.$.urgent.p_double(3);
  // @ts-expect-error not a number
  await interop.$.urgent.p_double("fast");
  const part = await interop.parts.get(3);
  // @ts-expect-error misspelt
  await part.$.urgent.identfy();
  await using held = await lease(part);
  void held;

  // Also of types that are written by hand.
  const own = await connect<{ readonly Drive: FunctionMember<[number], void> }>("ws://localhost/?service=any");
  await own.$.urgent.Drive(0);
  // @ts-expect-error misspelt
  await own.$.urgent.Drve(0);
}

/** What hooks, composables and stores give has the types of the members. */
export function show(): void {
  const url = "ws://localhost/?service=interop";
  const device = react.useDevice<declared.Interop>(url);
  const vueDevice = vue.useDevice<declared.Interop>(url);
  const subscription = subscribe<declared.Interop>(url);
  type Shifted = Promise<declared.Pose | null>;
  const call = react.useCall(device, "shift");
  same<ReturnType<typeof call.call>, Shifted>(true);
  same<typeof call.value, declared.Pose | null | undefined>(true);
  const vueCall = vue.useCall(vueDevice, "shift");
  same<ReturnType<typeof vueCall.call>, Shifted>(true);
  same<typeof vueCall.state.value.value, declared.Pose | null | undefined>(true);
  same<ReturnType<ReturnType<typeof svelte.callStore<declared.Interop, "shift">>["call"]>, Shifted>(true);
  const store = svelte.callStore(subscription, "shift").getSnapshot();
  same<typeof store.value, declared.Pose | null | undefined>(true);
  const { value } = react.useProperty(device, "p_double");
  same<typeof value, number | undefined>(true);
  const { state } = vue.useProperty(vueDevice, "p_double");
  same<typeof state.value.value, number | undefined>(true);
  const wire = react.useWire(react.useDevice<SimulatedCreate>(url), "packets");
  same<typeof wire.value, SensorPacket | null | undefined>(true);
  const vueWire = vue.useWire(vue.useDevice<SimulatedCreate>(url), "packets");
  same<typeof vueWire.value.value, SensorPacket | null | undefined>(true);
  react.useEvent(device, "changed", (value, why) => same<[typeof value, typeof why], [number, string]>(true));
  vue.useEvent(vueDevice, "changed", (value, why) => same<[typeof value, typeof why], [number, string]>(true));
  const any = react.useCall(react.useDevice(url), "Drive");
  same<typeof any.value, RrValue | undefined>(true);
}

/** What a property of a store is set to has the property's type. */
export async function set(): Promise<void> {
  const url = "ws://localhost/?service=interop";
  for (const property of [
    react.useProperty(react.useDevice<declared.Interop>(url), "p_double"),
    vue.useProperty(vue.useDevice<declared.Interop>(url), "p_double"),
    svelte.propertyStore(subscribe<declared.Interop>(url), "p_double"),
  ]) {
    await property.set(3);
    // @ts-expect-error not a number
    await property.set("fast");
  }
  await react.useProperty(react.useDevice<declared.Interop>(url), "p_any").set(rrValue("int16[]", [1, 2]));
  // @ts-expect-error readonly
  await vue.useProperty(vue.useDevice<SimulatedCreate>(url), "DistanceTraveled").set(3);
  await svelte.propertyStore(subscribe(url), "any").set("what the service takes");
}
