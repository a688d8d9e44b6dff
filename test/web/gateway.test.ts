// What the page reads of the gateway, and its own addresses.
import { formatRoute, parseRoute, splitSteps } from "../../web/src/app/router";
import { readRequests } from "../../web/src/gateway/access";
import { readDevices, relayUrl } from "../../web/src/gateway/devices";
import { mustSignIn, proofOf, readWho } from "../../web/src/gateway/session";

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
