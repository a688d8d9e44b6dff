// Recordings of the gateway: what it is asked, and what is made of its answers.
import { fileAddress, isUnderWay, readRecordings, RecordingDesk } from "../../web/src/gateway/recordings";
import { bytesText } from "../../web/src/ui/words";

const answer = (status: number, body: unknown = {}) => new Response(JSON.stringify(body), { status });
const given = {
  name: "create.Create.20261125T083000123Z",
  device: "create",
  service: "Create",
  state: "recording",
  standing: false,
  problem: null,
  begin: 1.5,
  seconds: 2,
  messages: 7,
  bytes: 3,
  replay: null,
  files: [{ name: "create.Create.20261125T083000123Z.mcap", bytes: 3, replay: null }, null],
};

describe("recordings", () => {
  beforeEach(() => vi.stubGlobal("document", { hidden: false, addEventListener() {}, removeEventListener() {} }));
  afterEach(() => vi.unstubAllGlobals());

  function setup() {
    const fetch = vi.fn((_path: string, _init?: RequestInit) => Promise.resolve(answer(200, { enabled: true })));
    return { fetch, desk: new RecordingDesk({ fetch }) };
  }

  it("are those that the gateway tells of, as far as it does", () => {
    const { enabled, bytes, list } = readRecordings({ enabled: true, bytes: 3, recordings: [given, 1] });
    expect([enabled, bytes, list.length]).toEqual([true, 3, 1]);
    expect(list[0]).toMatchObject({ beginMs: 1500, problem: "", replay: "", files: [{ bytes: 3 }] });
    const played = [{ replay: "replay~r" }, { files: [{}, { replay: "replay~r-2" }] }];
    expect(readRecordings({ recordings: played }).list.map(({ replay }) => replay)).toEqual(["replay~r", "replay~r-2"]);
    expect(list[0] && isUnderWay(list[0])).toBe(true);
    expect(readRecordings(null)).toEqual({ enabled: false, bytes: 0, maxBytes: 0, list: [] });
    expect(fileAddress({ name: "a b.mcap", bytes: 1 })).toBe("api/v1/recordings/a%20b.mcap");
    expect([0, 999, 1000, 123456, 2.5e9].map(bytesText)).toEqual(["0 B", "999 B", "1.0 kB", "123 kB", "2.5 GB"]);
  });

  it("are none at a gateway that knows of none, and follow the list while somebody looks", async () => {
    const { fetch, desk } = setup();
    fetch.mockResolvedValueOnce(answer(404));
    desk.start();
    await vi.waitFor(() => expect(desk.state.value?.enabled).toBe(false));
    desk.stop();
  });

  it("are begun, stopped, deleted and played, and a refusal is told until something is done", async () => {
    const { fetch, desk } = setup();
    const [recording] = readRecordings({ recordings: [given] }).list;
    if (!recording) throw new Error("there is none");
    fetch.mockResolvedValueOnce(answer(507, { detail: "the disk is full" }));
    await desk.begin("create", "Create");
    expect(desk.trouble.value).toBe("the disk is full");
    await desk.end(recording);
    expect(desk.trouble.value).toBeNull();
    await desk.remove(recording);
    await desk.play(recording);
    await desk.endPlaying(recording);
    desk.stop();
    const asked = fetch.mock.calls.filter(([, init]) => init?.method !== undefined);
    expect(asked.map(([path, init]) => [init?.method, path, init?.body])).toEqual([
      ["POST", "api/v1/recordings", '{"device":"create","service":"Create"}'],
      ["POST", `api/v1/recordings/${given.name}/stop`, "{}"],
      ["DELETE", `api/v1/recordings/${given.name}`, undefined],
      ["POST", `api/v1/recordings/${given.name}/play`, "{}"],
      ["DELETE", `api/v1/recordings/${given.name}/play`, undefined],
    ]);
  });
});
