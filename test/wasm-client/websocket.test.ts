// The WebSocket transport against a server in the same process.
import { createRequire } from "node:module";
import type { AddressInfo } from "node:net";
import { connect, ErrorCode } from "../../wasm-client/dist/node.js";
import { failure } from "./service.js";

interface Socket {
  on(event: string, heard: (...args: any[]) => void): void;
  send(data: string | Uint8Array): void;
  close(code?: number, reason?: string): void;
  terminate(): void;
}
interface Server {
  on(event: string, heard: (...args: any[]) => void): void;
  address(): AddressInfo;
  close(done?: () => void): void;
}
const { WebSocket: Base, WebSocketServer } = createRequire(new URL("../../wasm-client/package.json", import.meta.url))(
  "ws",
) as {
  WebSocket: new (url: string, protocols: string[], options: object) => object;
  WebSocketServer: new (options: object) => Server;
};

/** As Node's own: whoever uses it closes with the codes alone that the standard leaves to pages. */
class StrictWebSocket extends Base {
  constructor(url: string, { protocols, headers }: { protocols: string[]; headers: object }) {
    super(url, protocols, { headers });
    return new Proxy(this, {
      get: (socket, name) => {
        const value: unknown = Reflect.get(socket, name);
        if (typeof value !== "function") return value;
        return (...args: unknown[]): unknown => {
          const [code = 1000] = args as [number?];
          if (name === "close" && code !== 1000 && !(code >= 3000 && code <= 4999))
            throw new DOMException(`invalid code ${code}`, "InvalidAccessError");
          return Reflect.apply(value, socket, args);
        };
      },
      set: (socket, name, value) => Reflect.set(socket, name, value),
    });
  }
}

let server: Server;
let url: string;
let upgrade: { url: string; headers: Record<string, string | undefined> };
let greet: (socket: Socket) => void;

beforeEach(async () => {
  vi.stubGlobal("WebSocket", StrictWebSocket);
  greet = () => undefined;
  server = new WebSocketServer({
    host: "127.0.0.1",
    port: 0,
    handleProtocols: (offered: Set<string>) => [...offered][0],
  });
  server.on("connection", (socket: Socket, request: typeof upgrade) => {
    upgrade = request;
    greet(socket);
  });
  await new Promise((resolve) => server.on("listening", resolve as () => void));
  url = `ws://127.0.0.1:${server.address().port}/devices/create?service=Create`;
});
afterEach(() => {
  vi.unstubAllGlobals();
  return new Promise<void>((resolve) => server.close(() => resolve()));
});

it("asks for the subprotocol, sends no Origin, keeps path and query, and begins with CreateConnection", async () => {
  const first = new Promise<Buffer>((resolve) => {
    greet = (socket) => socket.on("message", (data: Buffer) => (resolve(data), socket.close(1000)));
  });
  const connecting = failure(connect(url));
  const bytes = await first;
  expect(bytes.subarray(0, 4).toString()).toBe("RRAC");
  expect(upgrade.url).toBe("/devices/create?service=Create");
  expect(upgrade.headers["sec-websocket-protocol"]).toBe("robotraconteur.robotraconteur.com");
  expect(upgrade.headers["origin"]).toBeUndefined();
  await connecting;
});

it("shows a token and further headers in the upgrade", async () => {
  greet = (socket) => socket.close(1000);
  await failure(connect(url, { token: "rrg_secret", headers: { "X-Cell": "3" } }));
  expect(upgrade.headers["authorization"]).toBe("Bearer rrg_secret");
  expect(upgrade.headers["x-cell"]).toBe("3");
});

it("uses Node's own WebSocket where there is one, with the same headers", async () => {
  const made: unknown[][] = [];
  class Native {
    constructor(...given: unknown[]) {
      made.push(given);
      throw new Error("not today");
    }
  }
  vi.stubGlobal("WebSocket", Native);
  expect((await failure(connect(url, { token: "rrg_secret" }))).message).toContain("not today");
  const protocols = ["robotraconteur.robotraconteur.com"];
  expect(made).toEqual([[url, { protocols, headers: { ["Authorization"]: "Bearer rrg_secret" } }]]);
});

it("asks a function for the URL", async () => {
  greet = (socket) => socket.close(1000);
  await failure(connect(() => Promise.resolve(`${url}&ticket=t1`)));
  expect(upgrade.url).toBe("/devices/create?service=Create&ticket=t1");
  const refusal = new Error("no ticket today");
  expect(await failure(connect(() => Promise.reject(refusal)))).toBe(refusal);
  const slow = await failure(connect(() => new Promise(() => undefined), { timeout: 20 }));
  expect(slow.code).toBe(ErrorCode.RequestTimeout);
  expect(slow.message).toContain("the function that gives the URL: no session within 20 ms");
});

it("says why the server closed", async () => {
  greet = (socket) => socket.close(1013, "device offline: create: connection refused");
  const error = await failure(connect(url));
  expect(error.code).toBe(ErrorCode.ConnectionError);
  expect(error.message).toMatch(
    /^the connection to ws:\/\/127\.0\.0\.1:\d+\/devices\/create was closed: device offline: create/,
  );
});

it("says so where the server gives no reason", async () => {
  greet = (socket) => socket.terminate();
  expect((await failure(connect(url))).message).toContain("WebSocket code 1006");
});

it("says where it could not connect to", async () => {
  const { port } = server.address();
  await new Promise<void>((resolve) => server.close(() => resolve()));
  const error = await failure(connect(url));
  expect(error.code).toBe(ErrorCode.ConnectionError);
  expect(error.message).toContain(`could not connect to ws://127.0.0.1:${port}/devices/create`);
  server = new WebSocketServer({ host: "127.0.0.1", port: 0 });
});

it("refuses text frames, and says so", async () => {
  const closed = new Promise((resolve) => {
    greet = (socket) => {
      socket.on("close", resolve);
      socket.send("hello");
    };
  });
  const error = await failure(connect(url));
  expect(error.code).toBe(ErrorCode.ConnectionError);
  expect(error.message).toMatch(/devices\/create was closed: found text, expected binary frames$/);
  await closed;
});

it("lets go of the socket when connecting is given up", async () => {
  const abort = new AbortController();
  const closed = new Promise((resolve) => {
    greet = (socket) => {
      socket.on("close", resolve);
      abort.abort(new Error("enough"));
    };
  });
  expect((await failure(connect(url, { signal: abort.signal }))).message).toBe("enough");
  await closed;
});
