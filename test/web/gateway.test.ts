import { formatRoute, parseRoute, splitSteps } from "../../web/src/app/router";
import { readRequests } from "../../web/src/gateway/access";
import { readDevices, relayUrl } from "../../web/src/gateway/devices";
import { mustSignIn, proofOf, readWho } from "../../web/src/gateway/session";
import { readFrame } from "../../web/src/camera/frame";
import type { Frame } from "../../web/src/camera/frame";
import { fit, gridStep, include, START, toCanvas } from "../../web/src/chart/view";
import { ended, sentence, span, staleAge } from "../../web/src/ui/words";

describe("access", () => {
  it("reads who the gateway takes the page for", () => {
    const who = { user: "root", roles: ["admin"], login: true, session: true, requests: true, admin: true };
    expect(readWho({ ...who, proof: "password" })).toEqual(who);
    const nobody = { user: null, roles: [], login: false, session: false, requests: false, admin: false };
    expect(readWho(null)).toEqual(nobody);
  });

  it("asks for a sign-in where there is nothing to see without", () => {
    const nobody = readWho({ login: true });
    expect(mustSignIn(nobody)).toBe(true);
    expect(mustSignIn({ ...nobody, roles: ["guest"] })).toBe(false);
    expect(mustSignIn({ ...nobody, user: "root" })).toBe(false);
    expect(mustSignIn(readWho({}))).toBe(false);
    expect(mustSignIn(null)).toBe(false);
  });

  it("shows a name and a password, or a token", () => {
    expect(proofOf("vera", "größer: als ")).toEqual({ user: "vera", password: "größer: als " });
    expect(proofOf("", " rrg_secret\n")).toEqual({ token: "rrg_secret" });
    expect(() => proofOf("a:b", "c")).toThrow("A name has no colon.");
  });

  it("lists the requests that are to be decided on", () => {
    const request = { id: "a", name: "tablet", reason: "cell 3", client: "192.0.2.1:5" };
    const answer = {
      requests: [{ ...request, state: "pending" }, { ...request, state: "approved" }, null, { state: "pending" }],
    };
    expect(readRequests(answer)).toEqual([request]);
    expect(readRequests({})).toEqual([]);
  });
});

describe("list of devices", () => {
  it("reads what the gateway says", () => {
    const device = {
      name: "create",
      url: "rr+tcp://127.0.0.1:52222/?service=Create",
      found: true,
      node_id: "{00}",
      node_name: "demo",
      state: "online",
      last_error: null,
      services: [{ name: "Create", type: "experimental.create2.Create" }],
      mode: "shared",
      clients: 3,
      safe: ["Create.Drive"],
    };
    const { node_id: nodeId, node_name: nodeName, last_error: lastError, ...rest } = device;
    expect(readDevices({ devices: [device] })).toEqual([{ ...rest, nodeId, nodeName, lastError }]);
  });
  it("does without fields that an older gateway leaves out", () => {
    expect(readDevices({ devices: [{ name: "arm", state: "sleeping" }, null] })).toEqual([
      {
        name: "arm",
        url: "",
        found: false,
        nodeId: "",
        nodeName: "",
        state: "offline",
        lastError: null,
        services: [],
        mode: null,
        clients: null,
        safe: [],
      },
    ]);
  });
  it("refuses an answer that is no list of devices", () => {
    expect(() => readDevices("<html>")).toThrow('no list "devices"');
    expect(() => readDevices(null)).toThrow('no list "devices"');
  });
  it("finds the relay beside the page, secure where the page is", () => {
    expect(relayUrl("create", "Create", "http://127.0.0.1:8080/")).toBe(
      "ws://127.0.0.1:8080/devices/create?service=Create",
    );
    expect(relayUrl("a b", "S&T", "https://host/robots/#/x")).toBe("wss://host/robots/devices/a%20b?service=S%26T");
  });
});

describe("addresses", () => {
  it("name pages, services and the objects in them", () => {
    expect(parseRoute("")).toEqual({ page: "devices" });
    expect(parseRoute("#/")).toEqual({ page: "devices" });
    expect(parseRoute("#/devices/create/Create")).toEqual({
      page: "service",
      device: "create",
      service: "Create",
      path: [],
      view: "auto",
      board: null,
    });
    expect(parseRoute("#/else")).toEqual({ page: "unknown", address: "/else" });
    expect(parseRoute("#/devices/%")).toEqual({ page: "unknown", address: "/devices/%" });
  });
  it("are read back as they were written", () => {
    const path = [
      { member: "Webcams", index: "0" },
      { member: "parts", index: "a/b]?" },
      { member: "lens", index: null },
    ];
    expect(parseRoute(formatRoute("my cam", "W", path))).toEqual({
      page: "service",
      device: "my cam",
      service: "W",
      path,
      view: "auto",
      board: null,
    });
    expect(parseRoute(formatRoute("c", "C", [], "members"))).toMatchObject({ view: "members" });
    expect(parseRoute(`${formatRoute("c", "C", [], "board")}&board=e30`)).toMatchObject({
      view: "board",
      board: "e30",
    });
  });

  it("leads to objects by steps whose keys may have dots", () => {
    expect(splitSteps("Webcams[0].lens")).toEqual(["Webcams[0]", "lens"]);
    expect(splitSteps("tools[left.hand].tip")).toEqual(["tools[left.hand]", "tip"]);
  });
});

describe("camera frames", () => {
  it("turns blue, green, red rows with padding into pixels", () => {
    const data = Uint8Array.of(1, 2, 3, 4, 5, 6, 0, 0, 7, 8, 9, 10, 11, 12);
    const frame = readFrame({ width: 2, height: 2, step: 8, data });
    expect(rgbaOf(frame)).toEqual([3, 2, 1, 255, 6, 5, 4, 255, 9, 8, 7, 255, 12, 11, 10, 255]);
  });
  it("shows one byte a pixel as grey", () => {
    expect(rgbaOf(readFrame({ width: 1, height: 1, step: 1, data: Uint8Array.of(9) }))).toEqual([9, 9, 9, 255]);
  });
  it("leaves image files to the browser", () => {
    const frame = readFrame({ width: 0, height: 0, step: 0, data: Uint8Array.of(0xff, 0xd8, 0xff, 0xe0) });
    expect(frame.encoded).toHaveLength(4);
  });
  it("refuses frames whose size and bytes contradict each other", () => {
    expect(() => readFrame({ width: 2, height: 2, step: 6, data: new Uint8Array(11) })).toThrow(
      "has 11 bytes in rows of 6; expected 12",
    );
    expect(() => readFrame({ width: 2, height: 2, step: 6, data: new Uint8Array(13) })).toThrow("13 bytes");
    expect(() => readFrame({ width: 20, height: 10, data: new Uint8Array(300) })).toThrow("300 bytes");
    expect(() => readFrame({ width: -1, height: 2, step: 6, data: new Uint8Array(12) })).toThrow("-1 by 2 pixels");
    expect(() => readFrame({ width: 1e9, height: 1e9, step: 6, data: new Uint8Array(12) })).toThrow("pixels");
    expect(() => readFrame(null)).toThrow("no bytes");
  });
});

describe("view of the chart", () => {
  it("fits the wanted floor, centred, north up", () => {
    const view = fit({ xMin: -2, xMax: 2, yMin: -1, yMax: 1 }, 10, 20, 400, 400);
    expect(view.scale).toBe(100);
    expect(toCanvas(view, 0, 0)).toEqual([210, 220]);
    expect(toCanvas(view, 2, 2)).toEqual([410, 20]);
  });
  it("grows in half metres to hold the robot, and stays while it is inside", () => {
    expect(include(START, 1, 1)).toBe(START);
    expect(include(START, 2.2, 0)).toEqual({ ...START, xMax: 3 });
    expect(include(START, NaN, 0)).toBe(START);
  });
  it("labels the grid at readable distances", () => {
    expect(gridStep(120)).toBe(0.5);
    expect(gridStep(60)).toBe(1);
    expect(gridStep(10)).toBe(10);
    expect(gridStep(0.001)).toBeGreaterThan(1000);
  });
});

describe("words", () => {
  it("say within a second that no newer value came, and how old the last one is", () => {
    expect([0, 799].map(staleAge)).toEqual([null, null]);
    expect([800, 1400, 3000, 61_000].map(staleAge)).toEqual(["1 s old", "1 s old", "3 s old", "1 min old"]);
  });
  it("say spans as people do", () => {
    expect(span(4_999)).toBe("4 s");
    expect(span(61_000)).toBe("1 min");
    expect(span(7_500_000)).toBe("2 h 5 min");
    expect(span(-5)).toBe("0 s");
  });
  it("end sentences once", () => {
    expect(ended("refused")).toBe("refused.");
    expect(ended("refused. ")).toBe("refused.");
  });
  it("begin sentences with a capital, but change no names", () => {
    expect(sentence("refused")).toBe("Refused.");
    expect(sentence("user 'vera' has no right")).toBe("User 'vera' has no right.");
    expect(sentence("can't be reached, and so on")).toBe("Can't be reached, and so on.");
    for (const text of ["rr+tcp://h:1/ refused.", "gateway.json: broken.", "'arm' is away.", "create: no answer."])
      expect(sentence(text)).toBe(text);
  });
});

function rgbaOf({ width, height, paint }: Frame): number[] {
  const pixels = new Uint32Array(width * height);
  paint?.(pixels);
  return [...new Uint8Array(pixels.buffer)];
}
