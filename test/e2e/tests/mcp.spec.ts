// Agents by the official TypeScript SDK of the Model Context Protocol: over HTTP, and by `rrgate mcp` on standard input and output.
import { Client } from "@modelcontextprotocol/sdk/client/index.js";
import { StdioClientTransport } from "@modelcontextprotocol/sdk/client/stdio.js";
import { StreamableHTTPClientTransport } from "@modelcontextprotocol/sdk/client/streamableHttp.js";
import { ResourceUpdatedNotificationSchema } from "@modelcontextprotocol/sdk/types.js";
import { expect, test } from "@playwright/test";
import { execFile } from "node:child_process";
import { connect, createServer } from "node:net";
import type { AddressInfo, Server, Socket } from "node:net";
import { join } from "node:path";
import { promisify } from "node:util";
import { deviceProgram, Program, rrgate, startGateway, webRoot } from "../processes";

const drive = { device: "create", path: "Create/Drive", why: "to see it move" };
const members = ["Drive"];

let create: Program;
let gateway: { program: Program; url: string };
let line: Line;

/** To the gateway; it can be cut. */
class Line {
  readonly #sockets = new Set<Socket>();
  readonly #server: Server;

  constructor(url: string) {
    this.#server = createServer((client) => {
      const service = connect(Number(new URL(url).port), "127.0.0.1");
      for (const [from, to] of [
        [client, service],
        [service, client],
      ] as const) {
        this.#sockets.add(from);
        from.pipe(to);
        from.on("error", () => to.destroy()).on("close", () => to.destroy());
      }
    });
  }

  async start(): Promise<string> {
    await new Promise<void>((resolve) => this.#server.listen(0, "127.0.0.1", resolve));
    return `http://127.0.0.1:${(this.#server.address() as AddressInfo).port}/`;
  }

  /** Ends what is connected; new connections are let through. */
  cut(): void {
    for (const each of this.#sockets) each.destroy();
    this.#sockets.clear();
  }

  stop(): void {
    this.#server.close();
    this.cut();
  }
}

test.beforeAll(async () => {
  create = new Program(deviceProgram("rrgate-demo-create"), ["--port", "0"]);
  create.start();
  const url = (await create.waitForOutput(/(rr\+tcp:\S+)/))[1] ?? "";
  const leases = { safe: [{ call: "Create.Drive", arguments: [0, 0] }] };
  gateway = await startGateway("create", url, webRoot, {
    devices: [{ name: "create", url, mode: "shared", leases }],
    mcp: {},
    access: {
      ["anonymous_role"]: "agent",
      rules: [
        { roles: ["agent"], may: ["read", "subscribe"] },
        {
          roles: ["agent"],
          members,
          may: ["call"],
          agent: { limits: { velocity: [-200, 200] }, approval: "none", ["hold_seconds"]: 20 },
        },
      ],
    },
  });
});

test.beforeEach(() => void (line = new Line(gateway.url)));

test.afterEach(() => line.stop());

test.afterAll(async () => {
  await gateway?.program.kill("SIGTERM");
  await create?.kill("SIGTERM");
});

const ways = {
  ["by HTTP"]: (url: string) => new StreamableHTTPClientTransport(new URL("mcp", url)),
  ["by standard input and output"]: (url: string) => new StdioClientTransport({ command: rrgate, args: ["mcp", url] }),
};

interface Told {
  isError?: boolean;
  structuredContent?: Record<string, unknown>;
}

for (const [way, open] of Object.entries(ways)) {
  test.describe(way, () => {
    let client: Client;
    const ask = async (name: string, args: Record<string, unknown>): Promise<Told> =>
      (await client.callTool({ name, arguments: args })) as Told;
    test.beforeEach(async () => {
      client = new Client({ name: "test", version: "1" });
      await client.connect(open(await line.start()));
    });
    test.afterEach(() => client.close());

    test("tools, resources and members are listed", async () => {
      const { tools } = await client.listTools();
      expect(tools.map(({ name }) => name)).toEqual(
        expect.arrayContaining(["devices", "describe", "read", "call", "stop"]),
      );
      const { resources } = await client.listResources();
      expect(resources.map(({ uri }) => uri)).toEqual(["rrgate://create"]);
      const { contents } = await client.readResource({ uri: "rrgate://create/Create" });
      expect(JSON.stringify(contents)).toContain("Drive");
      const described = await ask("describe", { device: "create", path: "Create/Drive" });
      expect(JSON.stringify(described.structuredContent)).toContain('"velocity":[-200');
    });

    test("changes are told of as long as they are wanted, and of what a cut has hidden", async () => {
      const [state, distance] = ["rrgate://create/Create/state", "rrgate://create/Create/DistanceTraveled"];
      const told: string[] = [];
      client.setNotificationHandler(ResourceUpdatedNotificationSchema, ({ params }) => void told.push(params.uri));
      const count = (uri: string): number => told.filter((each) => each === uri).length;
      await expect(client.subscribeResource({ uri: "rrgate://create/Create/nothing" })).rejects.toThrow();
      await client.subscribeResource({ uri: state });
      await expect.poll(() => count(state)).toBeGreaterThan(1);
      await client.unsubscribeResource({ uri: state });
      await client.subscribeResource({ uri: distance });
      await new Promise((resolve) => setTimeout(resolve, 3_000)); // the first, and what was on its way
      told.length = 0;
      await new Promise((resolve) => setTimeout(resolve, 3_000));
      expect(told).toEqual([]);
      line.cut();
      await expect.poll(() => told).toEqual([distance]);
    });

    test("a call is tried, is refused outside its limits, and is cancelled", async () => {
      const dry = await ask("call", { ...drive, args: { velocity: 100, radius: 0 }, ["dry_run"]: true });
      expect(dry.structuredContent).toMatchObject({ ["would_send"]: { velocity: 100 }, ["would_ask_a_person"]: false });
      const fast = await ask("call", { ...drive, args: { velocity: 300, radius: 0 } });
      expect(fast.isError).toBe(true);

      const cancelling = new AbortController();
      const heard: string[] = [];
      const calling = client
        .callTool({ name: "call", arguments: { ...drive, args: { velocity: 100, radius: 0 } } }, undefined, {
          signal: cancelling.signal,
          onprogress: ({ message }) => void heard.push(message ?? ""),
        })
        .then(() => "answered")
        .catch(() => "cancelled");
      await expect.poll(() => heard).toContain("the lease is held");
      const second = await ask("call", { ...drive, args: { velocity: 50, radius: 0 } });
      expect(JSON.stringify(second.structuredContent)).toContain("has the lease");
      cancelling.abort();
      expect(await calling).toBe("cancelled");
      // Nobody has the lease any more.
      await expect
        .poll(async () => {
          const again = new AbortController();
          const told: string[] = [];
          const result = client
            .callTool({ name: "call", arguments: { ...drive, args: { velocity: 0, radius: 0 } } }, undefined, {
              signal: again.signal,
              onprogress: ({ message }) => {
                told.push(message ?? "");
                if (message === "the lease is held") again.abort();
              },
            })
            .catch(() => null);
          await result;
          return told;
        })
        .toContain("the lease is held");
    });
  });
}

test("the inspector of the protocol finds nothing to complain about", async () => {
  const program = join(import.meta.dirname, "../node_modules/.bin/mcp-inspector");
  const inspect = async (...args: string[]) => {
    const target = ["--cli", new URL("mcp", gateway.url).href, "--transport", "http"];
    return promisify(execFile)(program, [...target, ...args], { timeout: 20_000 });
  };
  const tools = await inspect("--method", "tools/list", "--strict");
  expect(tools.stdout).toContain('"inputSchema"');
  expect(tools.stderr).not.toMatch(/Error:|Warning:/);
  const read = await inspect("--method", "resources/read", "--uri", "rrgate://create/Create/DistanceTraveled");
  expect(read.stdout).toContain('"mimeType": "application/json"');
  const args = JSON.stringify({ ...drive, args: { velocity: 100, radius: 0 }, ["dry_run"]: true });
  const call = await inspect("--method", "tools/call", "--tool-name", "call", "--tool-args-json", args);
  expect(call.stdout).toContain("would_send");
});
