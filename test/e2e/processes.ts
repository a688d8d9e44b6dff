// Starts the programs under test and ends them; a test that kills a device starts it again on the same port.
import { execFileSync, spawn } from "node:child_process";
import type { ChildProcess } from "node:child_process";
import { randomInt } from "node:crypto";
import { existsSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { createServer } from "node:net";
import { tmpdir } from "node:os";
import path from "node:path";
import { fileURLToPath } from "node:url";

const repository = path.resolve(path.dirname(fileURLToPath(import.meta.url)), "../..");
export const rrgate = process.env["RRGATE"] ?? path.join(repository, "build/release/server/rrgate");
export const repositoryRoot = repository;
export const webRoot = process.env["RRGATE_WEB_ROOT"] ?? path.join(repository, "web/dist");

/** A device's program: beside the gateway (installed) or in the build tree. */
export function deviceProgram(name: string): string {
  const folder = path.dirname(rrgate);
  const found = [".", "../examples/demo", "../libexec/rrgate"]
    .map((at) => path.join(folder, at, name))
    .find(existsSync);
  if (!found) throw new Error(`${name} is not beside ${rrgate} or in ../examples/demo; build the target ${name} first`);
  return found;
}

export class Program {
  #child: ChildProcess | null = null;
  #output = "";
  readonly #file: string;
  readonly #args: readonly string[];
  readonly #environment: Readonly<Record<string, string>>;

  constructor(file: string, args: readonly string[], environment: Readonly<Record<string, string>> = {}) {
    this.#file = file;
    this.#args = args;
    this.#environment = environment;
  }

  start(): void {
    if (this.#child) throw new Error(`${this.#file} runs already`);
    this.#output = "";
    const env = { ...process.env, ...this.#environment };
    const child = spawn(this.#file, this.#args, { env, stdio: ["pipe", "pipe", "pipe"] });
    const keep = (chunk: Buffer): void => void (this.#output = (this.#output + chunk.toString()).slice(-20_000));
    child.stdout.on("data", keep);
    child.stderr.on("data", keep);
    child.on("error", (error) => (this.#output += String(error)));
    this.#child = child;
  }

  /** Ends at once, as a crash or a pulled plug would. */
  async kill(signal: NodeJS.Signals = "SIGKILL"): Promise<void> {
    const child = this.#child;
    this.#child = null;
    if (!child || child.exitCode !== null || child.signalCode !== null) return;
    const ended = new Promise((resolve) => child.once("exit", resolve));
    child.kill(signal);
    await ended;
  }

  /** Such as SIGSTOP: it is there, and answers nothing. */
  signal(signal: NodeJS.Signals): void {
    this.#child?.kill(signal);
  }

  /** Waits for the process to write what `pattern` finds. */
  async waitForOutput(pattern: RegExp, withinMs = 30_000): Promise<RegExpExecArray> {
    const giveUp = Date.now() + withinMs;
    while (Date.now() < giveUp) {
      const found = pattern.exec(this.#output);
      if (found) return found;
      if (this.#child?.exitCode !== null) break;
      await pause(50);
    }
    throw new Error(`${this.#file} did not write ${pattern} within ${withinMs} ms; it wrote:\n${this.#output}`);
  }

  get output(): string {
    return this.#output;
  }

  /** undefined: it does not run. */
  get pid(): number | undefined {
    return this.#child?.pid;
  }
}

/** A gateway of its own to one device; `more`: of its configuration. */
export async function startGateway(
  device: string,
  deviceUrl: string,
  site: string,
  more: object = {},
): Promise<{ program: Program; url: string }> {
  const port = await freePort();
  const config = path.join(mkdtempSync(path.join(tmpdir(), "rrgate-e2e-")), "gateway.json");
  writeFileSync(
    config,
    JSON.stringify({
      listen: [`127.0.0.1:${port}`],
      web_root: site,
      devices: [{ name: device, url: deviceUrl }],
      ...more,
    }),
  );
  const program = new Program(rrgate, ["serve", "--config", config]);
  program.start();
  const url = `http://127.0.0.1:${port}/`;
  const giveUp = Date.now() + 30_000;
  while (!(await (await fetch(`${url}api/v1/devices`).catch(() => null))?.text())?.includes('"online"')) {
    if (Date.now() > giveUp) throw new Error(`${device} is not online:\n${program.output}`);
    await pause(100);
  }
  return { program, url };
}

/** Of 127.0.0.1, signed by a CA that no browser knows: the files of the certificate and its key. */
export function makeCertificate(): { cert: string; key: string } {
  const folder = mkdtempSync(path.join(tmpdir(), "rrgate-tls-"));
  execFileSync(rrgate, ["cert", "ca", folder]);
  execFileSync(rrgate, ["cert", "web", folder, "127.0.0.1"]);
  return { cert: path.join(folder, "127.0.0.1.pem"), key: path.join(folder, "127.0.0.1.key") };
}

/** The test service as device "big", and a gateway to it; `more`: of its configuration, by the URL of the device. */
export async function startTestService(
  site: string,
  more: (url: string) => object = () => ({}),
): Promise<{ url: string; stop(): Promise<void> }> {
  const service = path.join(path.dirname(rrgate), "../test/interop/cpp/rr-test-service");
  if (!existsSync(service)) throw new Error(`${service} is missing: build the target rr-test-service`);
  const device = new Program(service, []);
  device.start();
  const found = await device.waitForOutput(/"url": *"([^"]+)"/);
  const url = found[1] ?? "";
  const gateway = await startGateway("big", url, site, more(url));
  const stop = async () => {
    await gateway.program.kill("SIGTERM");
    await device.kill("SIGTERM");
  };
  return { url: gateway.url, stop };
}

/** The demo robot, its cameras, and a gateway to both, each a process of its own. */
export class Lab {
  readonly create: Program;
  readonly webcams: Program;
  readonly gateway: Program;
  readonly url: string;
  readonly createUrl: string;
  readonly #folder: string;

  private constructor(createPort: number, webcamsPort: number, gatewayPort: number) {
    this.#folder = mkdtempSync(path.join(tmpdir(), "rrgate-e2e-"));
    const config = path.join(this.#folder, "gateway.json");
    this.url = `http://127.0.0.1:${gatewayPort}/`;
    this.createUrl = `rr+tcp://127.0.0.1:${createPort}/?service=Create`;
    const webcamsUrl = `rr+tcp://127.0.0.1:${webcamsPort}/?service=Webcam`;
    writeFileSync(
      config,
      JSON.stringify({
        listen: [`127.0.0.1:${gatewayPort}`],
        web_root: webRoot,
        devices: [
          // As `rrgate demo` has them.
          {
            name: "create",
            url: this.createUrl,
            mode: "shared",
            leases: {
              members: [{ member: "Create.StartStreaming", lease: "never" }],
              safe: [{ call: "Create.Drive", arguments: [0, 0] }],
              takeover: ["*"],
            },
            callbacks: [{ member: "Create.play_callback", answer: "first" }],
          },
          { name: "webcams", url: webcamsUrl, mode: "shared" },
        ],
      }),
    );
    this.create = new Program(deviceProgram("rrgate-demo-create"), ["--port", String(createPort)]);
    this.webcams = new Program(deviceProgram("rrgate-demo-webcams"), [
      "--port",
      String(webcamsPort),
      "--robot",
      this.createUrl,
    ]);
    this.gateway = new Program(rrgate, ["serve", "--config", config]);
  }

  static async start(): Promise<Lab> {
    if (!existsSync(rrgate)) throw new Error(`${rrgate} is missing: build it, or name it in RRGATE`);
    if (!existsSync(path.join(webRoot, "index.html")))
      throw new Error(`${webRoot} is missing: run npm run build in web/`);
    const lab = new Lab(await freePort(), await freePort(), await freePort());
    for (const program of [lab.create, lab.webcams, lab.gateway]) program.start();
    await lab.waitUntilOnline();
    return lab;
  }

  /** Until the gateway has reached all devices. */
  async waitUntilOnline(withinMs = 30_000): Promise<void> {
    const giveUp = Date.now() + withinMs;
    for (;;) {
      const states = await this.deviceStates().catch(() => null);
      if (states && Object.values(states).every((state) => state === "online")) return;
      if (Date.now() > giveUp) {
        const wrote = [this.create, this.webcams, this.gateway].map((program) => program.output).join("\n");
        throw new Error(`devices are not online after ${withinMs} ms: ${JSON.stringify(states)}\n${wrote}`);
      }
      await pause(100);
    }
  }

  async deviceStates(): Promise<Record<string, string>> {
    const answer = (await (await fetch(`${this.url}api/v1/devices`)).json()) as {
      devices: { name: string; state: string }[];
    };
    return Object.fromEntries(answer.devices.map(({ name, state }) => [name, state]));
  }

  async stop(): Promise<void> {
    await Promise.all([this.gateway.kill("SIGTERM"), this.create.kill("SIGTERM"), this.webcams.kill("SIGTERM")]);
    rmSync(this.#folder, { recursive: true, force: true });
  }
}

/** Below those that the system gives to connections: until somebody listens on it, no connection takes it. */
export async function freePort(): Promise<number> {
  for (;;) {
    const port = randomInt(10_000, 32_768);
    const server = createServer();
    const isFree = await new Promise<boolean>((resolve) => {
      server.once("error", () => resolve(false));
      server.listen(port, "127.0.0.1", () => resolve(true));
    });
    await new Promise((resolve) => server.close(resolve));
    if (isFree) return port;
  }
}

function pause(ms: number): Promise<void> {
  return new Promise((resolve) => setTimeout(resolve, ms));
}
