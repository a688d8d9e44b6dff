// Devices in Python, each behind a gateway of its own.
import { existsSync } from "node:fs";
import path from "node:path";
import { freePort, Program, repositoryRoot, startGateway, webRoot } from "./processes";

export interface Peer {
  url: string;
  device: Program;
  stop(): Promise<void>;
}

/**
 * `script`: in the repository; it takes its port and writes "ready" when it serves. The device is called "peer".
 * `more`: of its configuration in the gateway.
 */
export async function startPeer(script: string, service: string, more: object = {}): Promise<Peer> {
  const port = await freePort();
  const device = pythonProgram(script, [String(port)]);
  device.start();
  await device.waitForOutput(/^ready$/m);
  const url = `rr+tcp://127.0.0.1:${port}/?service=${service}`;
  const gateway = await startGateway("peer", url, webRoot, { devices: [{ name: "peer", url, ...more }] });
  const stop = async () => {
    await gateway.program.kill("SIGTERM");
    await device.kill();
  };
  return { url: gateway.url, device, stop };
}

/** `script`: in the repository. */
export function pythonProgram(script: string, args: readonly string[]): Program {
  return pythonRun([path.join(repositoryRoot, script), ...args]);
}

/** An installed driver, by its module. */
export function pythonDriver(module: string, args: readonly string[]): Program {
  return pythonRun(["-m", module, ...args]);
}

function pythonRun(args: readonly string[]): Program {
  return new Program(python(), args);
}

/** One that has Robot Raconteur. */
export function python(): string {
  const found = process.env["RRGATE_PYTHON"] ?? path.join(repositoryRoot, "build/deps/venv/bin/python");
  if (!existsSync(found)) throw new Error(`${found} is missing: ./dev setup makes it, or name one in RRGATE_PYTHON`);
  return found;
}
