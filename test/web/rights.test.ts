// What a user may do, and what users did, as the gateway tells it.
import { readDeeds } from "../../web/src/gateway/audit";
import { readRights } from "../../web/src/gateway/rights";

describe("rights", () => {
  it("are told for each device: what holds for all of it, and what for some", () => {
    const answer = {
      proof: "password",
      expires_in: 60,
      may: ["metrics", 7],
      devices: { create: { read: "all", subscribe: "all", call: "some" }, arm: {}, odd: null },
    };
    expect(readRights(answer, 1_000)).toEqual({
      proof: "password",
      expiresAt: 61_000,
      gateway: ["metrics"],
      devices: [
        { device: "create", all: ["read", "subscribe"], some: ["call"] },
        { device: "arm", all: [], some: [] },
        { device: "odd", all: [], some: [] },
      ],
    });
  });

  it("that do not expire say so, and an older gateway, which tells none, is no gateway without rights", () => {
    expect(readRights({ expires_in: null, devices: {} })).toEqual({
      proof: "",
      expiresAt: null,
      gateway: [],
      devices: [],
    });
    expect(() => readRights({ user: "vera" })).toThrow('no object "devices"');
    expect(() => readRights(null)).toThrow('no object "devices"');
  });
});

describe("what users did", () => {
  const record = {
    seq: 17,
    time: "2030-01-31T12:00:00.123Z",
    event: "call",
    outcome: "ok",
    user: "alice",
    client: "192.0.2.7:40112",
    device: "create",
    path: "Create",
    member: "Drive",
  };
  const deed = { ...record, at: Date.UTC(2030, 0, 31, 12, 0, 0, 123), detail: "" };

  it("is read in the order of the gateway", () => {
    const { time: _, ...read } = deed;
    expect(readDeeds({ enabled: true, all: false, records: [record, null] })).toEqual({
      isRecorded: true,
      isAll: false,
      list: [read],
    });
  });

  it("is read as far as it can be; who is known to the device alone is told by that name", () => {
    const { list } = readDeeds({ enabled: true, all: true, records: [{ device_user: "bob", time: "later" }] });
    expect(list).toEqual([
      {
        seq: 0,
        at: NaN,
        user: "bob",
        client: "",
        event: "",
        outcome: "",
        device: "",
        path: "",
        member: "",
        detail: "",
      },
    ]);
  });

  it("is told apart: no audit log, and no answer", () => {
    expect(readDeeds({ enabled: false, all: true, records: [] })).toEqual({ isRecorded: false, isAll: true, list: [] });
    expect(() => readDeeds({})).toThrow('no list "records"');
  });
});
