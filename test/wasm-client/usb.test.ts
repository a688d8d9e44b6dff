// Services behind USB devices, by a navigator.usb that is not there: fake_usb.ts.
import { readFileSync } from "node:fs";
import { connect, ErrorCode, listUsbDevices, requestUsbDevice, subscribe } from "../../wasm-client/dist/node.js";
import type {
  DynamicMember,
  ObjectInfo,
  OpenTransport,
  Transport,
  TransportListener,
} from "../../wasm-client/dist/node.js";
import { FakeUsb, FakeUsbDevice } from "./fake_usb.js";
import type { FakeDeviceOptions } from "./fake_usb.js";
import { failure, settle, TestService } from "./service.js";

const definition = `service test.usb
stdver 0.10
object Root
  property double speed
  property double[] numbers
  function double same(double value)
  function void hang()
  event bump(int32 side, string text)
  function void fire_bump(int32 side, string text)
  wire double both
  function void publish_both(double value)
  pipe double echo
end`;

type Robot = Record<
  "speed" | "numbers" | "same" | "hang" | "bump" | "fire_bump" | "both" | "publish_both" | "echo",
  DynamicMember
>;
type Client = Robot & { readonly $: ObjectInfo };

const file = new URL("../../build/wasm/test/wasm-client/usb_device/test_usb_device.wasm", import.meta.url);
const code = WebAssembly.compile(readFileSync(file));
const url = "rr+usb:///?nodename=test.service&service=test";
const deviceId = "10203040-5060-7080-90a0-b0c0d0e0f001";
const le32 = (value: number) => [value & 255, (value >> 8) & 255, (value >> 16) & 255, value >> 24];

let usb: FakeUsb;
let device: FakeUsbDevice;

beforeEach(async () => {
  usb = new FakeUsb();
  vi.stubGlobal("navigator", { usb });
  device = await plug();
});
afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

async function plug(options: FakeDeviceOptions = {}): Promise<FakeUsbDevice> {
  const plugged = await FakeUsbDevice.make(await code, options);
  usb.plug(plugged);
  plugged.accept = await serve();
  return plugged;
}

/** A service, and a client of it for each stream. */
async function serve(): Promise<() => OpenTransport> {
  const first = await TestService.start({ definitions: [definition], root: "test.usb.Root" });
  let isTaken = false;
  return () => {
    if (isTaken) return first.join().transport;
    isTaken = true;
    return first.transport;
  };
}

/** Resolves with why the session ended. */
const lost = (robot: Client) => new Promise<any>((resolve) => robot.$.onClose(resolve));

/** Lets time pass until `promise` is settled. */
async function letPass<T>(promise: Promise<T>): Promise<T> {
  let isSettled = false;
  void promise.finally(() => (isSettled = true));
  while (!isSettled) {
    await vi.advanceTimersByTimeAsync(100);
    await new Promise(setImmediate); // compiling the core is no timer
  }
  return promise;
}

/** Until the client has given the device back. */
const givenBack = (one = device) => vi.waitFor(() => expect(one.opened).toBe(false), { interval: 1 });

describe("a session", () => {
  it("has properties, functions, events, wires and pipes", async () => {
    const robot = await connect<Robot>(url);
    await robot.speed.set(2.5);
    expect(await robot.speed.get()).toBe(2.5);
    expect(await robot.same(5)).toBe(5);
    const heard = robot.bump.once();
    await robot.fire_bump(1, "left");
    expect(await heard).toEqual([1, "left"]);
    const wire = robot.both.connect();
    await robot.publish_both(7);
    for await (const value of wire) {
      expect(value).toBe(7);
      break;
    }
    const pipe = await robot.echo.connect();
    await pipe.send(1);
    await pipe.send(2);
    const packets = pipe[Symbol.asyncIterator]();
    expect([(await packets.next()).value, (await packets.next()).value]).toEqual([1, 2]);
    await robot.$.close();
    await givenBack();
  });

  it("asks the device what the reference asks, and gives it back behind the last stream", async () => {
    const robot = await connect<Robot>(url);
    await robot.$.close();
    await givenBack();
    const withoutData = device.log.filter((entry) => !/^out [1-9]/.test(entry));
    expect(withoutData).toEqual([
      "open",
      "80 06 0f00 0000 5",
      "80 06 0f00 0000 36",
      "claim 0",
      "c1 ba 0000 0500 8",
      "c1 ba 0000 0500 22",
      "80 06 0300 0409 255",
      "80 06 0304 0409 255",
      "80 06 0305 0409 255",
      "c1 03 0000 0000 4",
      "out 0",
      "41 06 0000 0000 2: 01 01",
      "c1 01 0000 0000 4",
      "41 02 0000 0000 4: 07 00 00 00",
      "c1 03 0000 0000 4",
      "release 0",
      "close",
    ]);
    // What it said when it was closed went out before.
    expect(device.log.map((entry) => entry.startsWith("out")).lastIndexOf(true)).toBe(
      device.log.indexOf("41 02 0000 0000 4: 07 00 00 00") - 1,
    );
  });

  it.each([9, 64, 512, 1024])("carries large values in packets of %i bytes", async (packetSize) => {
    usb.unplug(device);
    await plug({ packetSize });
    const robot = await connect<Robot>(url);
    const numbers = Float64Array.from({ length: packetSize === 9 ? 100 : 40_000 }, (_, index) => index / 3);
    await robot.numbers.set(numbers);
    expect(await robot.numbers.get()).toEqual(numbers);
    await robot.$.close();
  });

  it("honours interface number and vendor code, and selects a configuration where there is none", async () => {
    usb.unplug(device);
    device = await plug({ interface: 2, vendorCode: 0x42, isConfigured: false });
    const robot = await connect<Robot>(url);
    expect(await robot.same(2)).toBe(2);
    await robot.$.close();
    await givenBack();
    expect(device.log.slice(0, 6)).toEqual([
      "open",
      "select 1",
      "80 06 0f00 0000 5",
      "80 06 0f00 0000 36",
      "claim 2",
      "c1 42 0000 0502 8",
    ]);
  });

  it("shares the device with others, and connects again afterwards", async () => {
    const [one, two] = await Promise.all([connect<Robot>(url), connect<Robot>(url)]);
    await Promise.all([one.speed.set(3), two.same(1)]);
    expect(await two.speed.get()).toBe(3);
    expect(device.streamCount).toBe(2);
    await one.$.close();
    expect(await two.same(9)).toBe(9);
    expect(device.opened).toBe(true);
    const closing = two.$.close();
    const three = connect<Robot>(url); // while the claim ends
    await closing;
    expect(await (await three).same(13)).toBe(13);
    await (await three).$.close();
    await givenBack();
    expect(device.streamCount).toBe(0);
  });

  it("leaves a device open that the page had opened", async () => {
    await device.open();
    const robot = await connect<Robot>(url);
    await robot.$.close();
    await vi.waitFor(() => expect(device.log.at(-1)).toBe("release 0"), { interval: 1 });
    await settle();
    expect(device.opened).toBe(true);
  });
});

describe("the device is found", () => {
  it.each([
    `nodeid=${deviceId}`,
    `nodeid={${deviceId.toUpperCase()}}`,
    `nodeid=${deviceId.replaceAll("-", "")}&nodename=test.service`,
  ])("by %s", async (who) => {
    const other = await plug({ name: "other", lastIdByte: 2 });
    const opened = new Promise<void>((resolve) => (device.accept = () => (resolve(), silent)));
    const ended = new AbortController();
    const connecting = failure(connect(`rr+usb://localhost/?service=test&${who}`, { signal: ended.signal }));
    await opened;
    ended.abort(new Error("enough"));
    expect((await connecting).message).toBe("enough");
    await Promise.all([givenBack(), givenBack(other)]);
  });

  it("or told what there is instead", async () => {
    await plug({ name: "other", lastIdByte: 2 });
    for (let round = 0; round < 2; ++round) {
      const error = await failure(connect("rr+usb:///?nodename=robot&service=test"));
      expect(error.code).toBe(ErrorCode.ConnectionError);
      expect(error.message).toBe(
        'rr+usb:///?nodename=robot&service=test: found on none of this page\'s USB devices: USB device "Test robot" (1209:5252): ' +
          `is node ${deviceId} "test.service"; USB device "Test robot" (1209:5252): is node 10203040-5060-7080-90a0-b0c0d0e0f002 "other"`,
      );
      await givenBack();
    }
    expect(device.log.filter((entry) => entry === "open")).toHaveLength(1); // who it is, is known
  });

  it("or what to do where the page may use none", async () => {
    usb.unplug(device);
    expect((await failure(connect(url))).message).toContain("let the user choose one with requestUsbDevice()");
  });

  it.each(["nodeid=1234", "nodeid=xyz"])("not by %s", async (who) => {
    const error = await failure(connect(`rr+usb:///?${who}&service=test`));
    expect(error.code).toBe(ErrorCode.InvalidArgument);
    expect(error.message).toContain("expected the like of 82301bf1");
  });
});

describe("a device that cannot be had", () => {
  it("is waited for while another page lets go of it", async () => {
    device.isBusy = true;
    const connecting = connect<Robot>(url);
    await new Promise((resolve) => setTimeout(resolve, 50));
    device.isBusy = false;
    const robot = await connecting;
    expect(await robot.same(3)).toBe(3);
    await robot.$.close();
  });

  it("is told where another program keeps it", async () => {
    vi.useFakeTimers({ toFake: ["setTimeout", "clearTimeout", "performance"] });
    device.isBusy = true;
    expect((await letPass(failure(connect(url)))).message).toMatch(
      /USB device "Test robot" \(1209:5252\): Robot Raconteur descriptor block: another program or driver uses the interface; close the other program/,
    );
    expect(device.opened).toBe(false);
  });

  it("is told where the system keeps this user from it", async () => {
    device.isDenied = true;
    expect((await failure(connect(url))).message).toMatch(
      /could not be opened: Access denied\.; on Linux .* on Windows/,
    );
  });

  it.each<[string, (device: FakeUsbDevice) => void, RegExp]>([
    ["has no BOS", (one) => one.replaceBos([]), /BOS descriptor: refused by the device \(stall\)/],
    [
      "has another BOS",
      (one) => one.replaceBos([5, 15, 12, 0, 1, 7, 16, 2, 0, 0, 0, 0]),
      /no Robot Raconteur capability/,
    ],
    ["has no block", (one) => one.stallControl(0xba), /descriptor block: refused/],
    [
      "has a block of another version",
      (one) => one.replaceBlock([8, 0, 0, 0, 0, 2, 22, 0]),
      /version: found 0x0200, expected 0x0100/,
    ],
    ["has a NodeID that is none", (one) => one.replaceString(4, [6, 3, 120, 0, 121, 0]), /NodeID string: /],
    [
      "has half a string",
      (one) => one.replaceString(5, [6, 3, 120, 0]),
      /string descriptor bLength: found 6, expected the 4 bytes received/,
    ],
  ])("%s", async (_, spoil, message) => {
    spoil(device);
    const error = await failure(connect(url));
    expect(error.code).toBe(ErrorCode.ConnectionError);
    expect(error.message).toMatch(message);
    await givenBack();
  });

  it.each<[string, (device: FakeUsbDevice) => void, RegExp]>([
    [
      "no more streams",
      (one) => one.answerConnect(le32(-1)),
      /could not connect: USB device .*: stream refused: the device answered -1/,
    ],
    ["half an answer", (one) => one.answerConnect([1, 0]), /stream refused: 2 bytes in the answer, expected 4/],
    ["a stall", (one) => one.stallControl(1), /stream refused: refused by the device \(stall\)/],
    ["no reset", (one) => one.stallControl(3), /reset: refused by the device \(stall\)/],
    ["a reset of another size", (one) => one.answerReset([0, 0]), /reset: 2 bytes in the answer, expected 4/],
    ["another protocol", (one) => (one.stalledVendorRequest = 6), /protocol 0x0101: refused/],
  ])("has %s", async (_, spoil, message) => {
    spoil(device);
    const error = await failure(connect(url));
    expect(error.code).toBe(ErrorCode.ConnectionError);
    expect(error.message).toMatch(message);
    await givenBack();
  });

  it.each([
    [6, "BOS descriptor: no answer in time"],
    [0xba, "descriptor block: no answer in time"],
    [1, "stream refused: no answer in time"],
    [3, "reset: no answer in time"],
  ])("does not answer request %i", async (request, message) => {
    vi.useFakeTimers({ toFake: ["setTimeout", "clearTimeout", "performance"] });
    device.muteRequest = request;
    expect((await letPass(failure(connect(url)))).message).toContain(message);
    await vi.advanceTimersByTimeAsync(5000); // the reset at the end
    expect(device.opened).toBe(false);
  });
});

describe("a session that is up", () => {
  let robot: Client;
  let other: Client;
  beforeEach(async () => {
    robot = await connect<Robot>(url);
    other = await connect<Robot>(url);
  });

  it.each<[string, (device: FakeUsbDevice) => void]>([
    ["the browser says so at once", (one) => usb.unplug(one)],
    ["the browser says so first", (one) => (usb.tellGone(one), one.unplug("NotFoundError"))],
    ["transfers fail first", (one) => (one.unplug("NetworkError"), setTimeout(() => usb.tellGone(one), 50))],
  ])("is lost when the device is unplugged: %s", async (_, unplug) => {
    const calls = [failure(robot.hang()), failure(other.hang())];
    const ends = [lost(robot), lost(other)];
    device.isDeaf = true;
    const writing = failure(robot.numbers.set(new Float64Array(10_000))); // transfers are pending
    await settle();
    unplug(device);
    for (const reason of await Promise.all([...calls, ...ends, writing])) {
      expect(reason.subName).toBe("connection_lost");
      expect(reason.message).toMatch(
        /the connection was lost: USB device "Test robot" \(1209:5252\): .*(unplugged|is gone); plug it in again/,
      );
    }
    const again = await plug();
    expect(await (await connect<Robot>(url)).same(3)).toBe(3);
    usb.unplug(again);
  });

  it.each<[string, (device: FakeUsbDevice) => void, RegExp]>([
    ["stalls a read", (one) => one.stallNextIn(), /read: refused by the device \(stall\)/],
    [
      "stalls a write",
      (one) => (one.stallNextOut(), void failure(robot.hang())),
      /write: refused by the device \(stall\)/,
    ],
    ["tells a wrong length", (one) => one.sendRaw([9, 0, 0, 0, 7, 0, 0, 0]), /len is 9, the transfer has 8 bytes/],
    ["sends half a header", (one) => one.sendRaw([5, 0, 0, 0, 7]), /found 5 bytes, expected 8 or more/],
    ["sends more than a packet", (one) => one.sendRaw(Array<number>(65).fill(0)), /sent more than was asked for/],
    [
      "sends more than a packet and the browser lets it through",
      (one) => ((one.isUnbounded = true), one.sendRaw([73, ...Array<number>(72).fill(0)])),
      /sent more than was asked for/,
    ],
    ["sends a command", (one) => one.sendRaw([8, 0, 1, 0, 7, 0, 0, 0]), /a command/],
    ["sends unknown flags", (one) => one.sendRaw([8, 0, 7, 0, 7, 0, 0, 0]), /flags 0x0007/],
    ["sends half a notification", (one) => one.sendRaw([9, 0, 2, 0, 7, 0, 0, 0, 1]), /found 1 bytes, expected 2/],
  ])("is lost when the device %s, and so are the others; they may connect again", async (_, spoil, message) => {
    const ends = [lost(robot), lost(other)];
    spoil(device);
    for (const reason of await Promise.all(ends)) {
      expect(reason.subName).toBe("connection_lost");
      expect(reason.message).toMatch(message);
    }
    await givenBack();
    robot = await connect<Robot>(url);
    expect(await robot.same(3)).toBe(3);
    await robot.$.close();
  });

  it.each<[string, number[]]>([
    ["packets without anything", []],
    ["packets without data", [8, 0, 0, 0, 7, 0, 0, 0]],
    ["data of streams that nobody knows", [9, 0, 0, 0, 99, 0, 0, 0, 1]],
    ["notifications that mean nothing", [10, 0, 2, 0, 7, 0, 0, 0, 0, 0]],
    ["notifications that nobody knows", [10, 0, 2, 0, 7, 0, 0, 0, 77, 0]],
  ])("outlives %s", async (_, transfer) => {
    for (let round = 0; round < 6; ++round) device.sendRaw(transfer);
    expect(await robot.same(3)).toBe(3);
    expect(await other.same(7)).toBe(7);
    await Promise.all([robot.$.close(), other.$.close()]);
  });

  it("is lost alone when the device closes its stream", async () => {
    const end = lost(robot);
    device.closeStream(7);
    expect((await end).message).toMatch(/the connection was lost: USB device .*: closed by the device/);
    expect(await other.same(7)).toBe(7);
    expect(device.log).not.toContain("41 02 0000 0000 4: 07 00 00 00");
    await other.$.close();
    await givenBack();
  });

  it("sends nothing on a stream that is paused, until it is resumed", async () => {
    device.notify(7, 2);
    await settle();
    const calling = robot.same(3);
    expect(await other.same(7)).toBe(7);
    const before = device.log.length;
    await settle();
    expect(device.log.length).toBe(before);
    device.notify(7, 3);
    await settle();
    expect(await calling).toBe(3);
    await Promise.all([robot.$.close(), other.$.close()]);
  });

  it("closes though the device takes nothing any more", async () => {
    vi.useFakeTimers({ toFake: ["setTimeout", "clearTimeout", "performance"] });
    device.isDeaf = true;
    for (let count = 0; count < 100; ++count) void failure(robot.numbers.set(new Float64Array(1000)));
    await settle();
    await letPass(Promise.all([robot.$.close(), other.$.close()]));
    await vi.advanceTimersByTimeAsync(1000);
    expect(device.opened).toBe(false);
  });
});

describe("the stream below", () => {
  /** The transport that connect() uses, without a session on it. */
  async function open(listener: Partial<TransportListener> = {}): Promise<Transport> {
    const { openUsb } = await import("../../wasm-client/dist/internal.js");
    let opened!: () => void;
    const isOpen = new Promise<void>((resolve) => (opened = resolve));
    const silent = { opened, received: () => undefined, closed: () => undefined };
    const transport = await openUsb(new URL("rr+usb:///?nodename=test.service"), { ...silent, ...listener });
    await isOpen;
    return transport;
  }

  it("says what it holds back, and posts four transfers at most", async () => {
    let received = 0;
    device.accept = () => () => ({
      send: (bytes) => void (received += bytes.length),
      buffered: 0,
      close: () => undefined,
    });
    const transport = await open();
    const sent = 300_000;
    device.isDeaf = true;
    transport.send(new Uint8Array(sent));
    // 56 bytes fit into a packet. The device takes 74 before it holds 4096 bytes; four more are under way.
    await vi.waitFor(() => expect(transport.buffered).toBe(sent - (74 + 4) * 56), { interval: 1 });
    await new Promise((resolve) => setTimeout(resolve, 10));
    expect(transport.buffered).toBe(sent - (74 + 4) * 56);
    device.hear();
    await vi.waitFor(() => expect(received).toBe(sent));
    expect(transport.buffered).toBe(0);
    transport.close();
    await givenBack();
  });

  it("delivers what was sent before it is closed, and says nothing afterwards", async () => {
    let received = 0;
    device.accept = () => () => ({
      send: (bytes) => void (received += bytes.length),
      buffered: 0,
      close: () => undefined,
    });
    const heard: string[] = [];
    const transport = await open({
      received: () => void heard.push("bytes"),
      closed: (reason) => void heard.push(reason),
    });
    device.isDeaf = true;
    transport.send(new Uint8Array(10_000));
    transport.close();
    transport.close();
    transport.send(new Uint8Array(10));
    device.send(7, Uint8Array.of(1, 2, 3));
    await new Promise((resolve) => setTimeout(resolve, 50));
    device.hear();
    await givenBack();
    expect(received).toBe(10_000);
    expect(heard).toEqual([]);
  });

  it("outlives a listener that closes it while it is told something", async () => {
    const transport = await open({ received: () => transport.close() });
    device.send(7, new Uint8Array(1000));
    await givenBack();
    expect(device.streamCount).toBe(0);
  });

  it("cannot be had behind the device's limit, the others live on", async () => {
    usb.unplug(device);
    device = await plug({ maxStreams: 2 });
    const [one, two] = [await connect<Robot>(url), await connect<Robot>(url)];
    expect((await failure(connect(url))).message).toContain("takes no more");
    expect(await one.same(3)).toBe(3);
    await Promise.all([one.$.close(), two.$.close()]);
  });
});

it("subscriptions go on when the device is plugged in again", async () => {
  const subscription = subscribe<Robot>(url, { firstRetry: 1 });
  expect(await (await subscription.client()).same(3)).toBe(3);
  const lost = new Promise((resolve) => subscription.onLost(resolve));
  usb.unplug(device);
  await lost;
  device = await plug();
  expect(await (await subscription.client()).same(7)).toBe(7);
  await subscription.close();
  await givenBack();
});

describe("requestUsbDevice()", () => {
  beforeEach(() => usb.unplug(device));

  it("lets the user choose among devices with a vendor specific interface, and tells which node it is", async () => {
    usb.choice = await FakeUsbDevice.make(await code, { name: "arm" });
    expect(await requestUsbDevice()).toEqual({
      device: 'USB device "Test robot" (1209:5252)',
      nodeId: deviceId,
      nodeName: "arm",
      url: `rr+usb:///?nodeid=${deviceId}`,
    });
    expect(usb.asked).toEqual([{ filters: [{ classCode: 0xff }] }]);
    expect(usb.choice.opened).toBe(false);
  });

  it("asks before anything else, as long as the click counts", () => {
    void failure(requestUsbDevice([{ vendorId: 0x1209 }]));
    expect(usb.asked).toEqual([{ filters: [{ vendorId: 0x1209 }] }]);
  });

  it("says that nothing was chosen", async () => {
    const error = await failure(requestUsbDevice());
    expect(error.code).toBe(ErrorCode.OperationCancelled);
  });

  it("says that it needs a click", async () => {
    usb.choice = new DOMException("Must be handling a user gesture to show a permission request.", "SecurityError");
    const error = await failure(requestUsbDevice());
    expect(error.code).toBe(ErrorCode.InvalidOperation);
    expect(error.message).toContain("Must be handling a user gesture");
  });

  it("says so in a worker", async () => {
    delete usb.requestDevice;
    expect((await failure(requestUsbDevice())).message).toContain("ask in the page");
  });

  it("says what is wrong with the device", async () => {
    usb.choice = await FakeUsbDevice.make(await code, { classCode: 3 });
    expect((await failure(requestUsbDevice())).message).toMatch(
      /^USB device "Test robot" \(1209:5252\): is no Robot Raconteur device/,
    );
  });
});

describe("listUsbDevices()", () => {
  it("asks each device who it is, once", async () => {
    const other = await plug({ name: "other", lastIdByte: 0, classCode: 255 });
    other.replaceString(4, [8, 3, 123, 0, 48, 0, 125, 0]); // {0}: any
    const robot = await connect<Robot>(url);
    for (let round = 0; round < 2; ++round) {
      expect(await listUsbDevices()).toMatchObject([
        { nodeId: deviceId, nodeName: "test.service", url: `rr+usb:///?nodeid=${deviceId}` },
        { nodeId: "00000000-0000-0000-0000-000000000000", nodeName: "other", url: "rr+usb:///?nodename=other" },
      ]);
    }
    expect(other.log.filter((entry) => entry === "open")).toHaveLength(1);
    expect(device.log.filter((entry) => entry === "open")).toHaveLength(1);
    await robot.$.close();
  });

  it("says why a device does not tell, and leaves out those that cannot be nodes", async () => {
    device.stallControl(0xba);
    await plug({ classCode: 3 });
    const [one, ...more] = await listUsbDevices();
    expect(more).toEqual([]);
    expect(one?.url).toBeUndefined();
    expect(one?.error?.message).toContain("descriptor block: refused by the device");
  });

  it("says that a frame may not", async () => {
    usb.isForbidden = true;
    const error = await failure(listUsbDevices());
    expect(error.code).toBe(ErrorCode.SystemResourcePermissionDenied);
    expect(error.message).toContain('a frame needs allow="usb"');
  });
});

describe("without WebUSB", () => {
  it.each([connect.bind(null, url), listUsbDevices, requestUsbDevice.bind(null, undefined)])(
    "everything says so",
    async (call) => {
      vi.stubGlobal("navigator", {});
      const error = await failure(call());
      expect(error.code).toBe(ErrorCode.SystemResourceError);
      expect(error.message).toContain("this browser has no WebUSB");
      vi.stubGlobal("isSecureContext", false);
      expect((await failure(call())).message).toContain("serve this one by https:");
    },
  );
});

const silent: OpenTransport = () => ({ send: () => undefined, buffered: 0, close: () => undefined });
