// How a page shows a token: as a ticket of the gateway, a new one for each connection.
import { connect, ErrorCode } from "../../wasm-client/dist/index.js";
import type { RobotRaconteurError } from "../../wasm-client/dist/index.js";

/** Not that of service.ts: it loads node.ts, whose ways take the place of a page's. */
const failure = (promise: Promise<unknown>) =>
  promise.then(
    () => expect.unreachable(),
    (error: RobotRaconteurError) => error,
  );

const url = "wss://gateway.lab/cell/devices/create?service=Create";
let asked: [string, RequestInit][];
let opened: string[];
let answer: () => Response;

beforeEach(() => {
  asked = [];
  opened = [];
  answer = () => Response.json({ ticket: `t${asked.length}`, ["expires_in"]: 30 }, { status: 201 });
  vi.stubGlobal("fetch", (to: URL, request: RequestInit) => {
    if (to.href.endsWith(".wasm")) return Promise.reject(new Error("the core is not asked for"));
    asked.push([to.href, request]);
    return Promise.resolve().then(answer);
  });
  vi.stubGlobal(
    "WebSocket",
    class {
      constructor(to: string) {
        opened.push(to);
        throw new Error("nobody is there");
      }
    },
  );
});
afterEach(() => void vi.unstubAllGlobals());

it("exchanges the token for a ticket at the gateway of the URL, for each connection", async () => {
  for (const _ of [1, 2])
    expect((await failure(connect(url, { token: "rrg_secret" }))).message).toContain("nobody is there");
  const where = "https://gateway.lab/cell/api/v1/tickets";
  expect(asked.map(([to]) => to)).toEqual([where, where]);
  const request = { method: "POST", headers: { ["Authorization"]: "Bearer rrg_secret" }, credentials: "omit" };
  expect(asked[0]?.[1]).toMatchObject(request);
  expect(opened).toEqual([`${url}&ticket=t1`, `${url}&ticket=t2`]);
});

it("says that the token was refused, and that the gateway is away", async () => {
  answer = () => new Response("", { status: 401 });
  const refused = await failure(connect(url, { token: "rrg_old" }));
  expect(refused.code).toBe(ErrorCode.AuthenticationError);
  expect(refused.message).toBe("no ticket of https://gateway.lab/cell/api/v1/tickets: HTTP 401");
  answer = () => {
    throw new TypeError("Failed to fetch");
  };
  const away = await failure(connect(url, { token: "rrg_old" }));
  expect(away.code).toBe(ErrorCode.ConnectionError);
  expect(away.message).toContain("Failed to fetch");
  expect(opened).toEqual([]);
});

it.each([
  ["a page", () => new Response("<!doctype html>")],
  ["no ticket", () => Response.json({ tickets: [] })],
  ["nothing", () => Response.json(null)],
])("says that %s is no ticket", async (_, given) => {
  answer = given;
  const error = await failure(connect(url, { token: "rrg_secret" }));
  expect(error.code).toBe(ErrorCode.ConnectionError);
  expect(error.message).toBe("no ticket of https://gateway.lab/cell/api/v1/tickets: HTTP 200");
  expect(opened).toEqual([]);
});

it("refuses headers, which a page can't add", async () => {
  expect((await failure(connect(url, { headers: { "X-Cell": "3" } }))).code).toBe(ErrorCode.InvalidArgument);
  expect(asked).toEqual([]);
});

it("asks for nothing without a token", async () => {
  await failure(connect(url));
  expect(asked).toEqual([]);
  expect(opened).toEqual([url]);
});
