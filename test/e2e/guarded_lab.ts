// A gateway that asks who one is, in front of the demo robot, and of its cameras and of Baxter where they are wanted; it can be stopped and started again on its port.
import { execFileSync } from "node:child_process";
import { mkdtempSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";
import { pythonProgram } from "./peers";
import { deviceProgram, freePort, Program, rrgate } from "./processes";

export const password = "of it all";

interface Ports {
  create: number;
  gateway: number;
  /** null: not wanted. */
  webcams: number | null;
  baxter: number | null;
}

export class GuardedLab {
  readonly create: Program;
  readonly webcams: Program | null = null;
  readonly baxter: Program | null = null;
  readonly gateway: Program;
  readonly url: string;
  readonly token: string;

  private constructor(ports: Ports, site: string, device: object, more: object) {
    const folder = mkdtempSync(path.join(tmpdir(), "rrgate-e2e-"));
    const file = (name: string): string => path.join(folder, name);
    for (const [name, roles] of [
      ["root", "admin"],
      ["vera", "viewer"],
    ] as const)
      execFileSync(rrgate, ["passwd", file("users"), name, "--roles", roles], { input: `${password}\n` });
    const made = execFileSync(rrgate, ["token", file("tokens"), "page", "--roles", "admin"], { encoding: "utf8" });
    this.token = made.trim();
    writeFileSync(file("ticket.key"), "of this lab alone ".repeat(3));
    const all = ["read", "write", "call", "subscribe", "lock", "admin"];
    const access = {
      ["users_file"]: "users",
      ["tokens_file"]: "tokens",
      ["ticket_key_file"]: "ticket.key", // sign-ins hold when the gateway starts again
      rules: [
        { roles: ["admin"], may: all },
        { roles: ["viewer"], may: ["read"] },
      ],
    };
    const createUrl = `rr+tcp://127.0.0.1:${ports.create}/?service=Create`;
    const devices: object[] = [{ name: "create", url: createUrl, ...device }];
    if (ports.webcams !== null) {
      devices.push({ name: "webcams", url: `rr+tcp://127.0.0.1:${ports.webcams}/?service=Webcam` });
      const options = ["--port", String(ports.webcams), "--robot", createUrl];
      this.webcams = new Program(deviceProgram("rrgate-demo-webcams"), options);
    }
    if (ports.baxter !== null) {
      devices.push({ name: "baxter", url: `rr+tcp://127.0.0.1:${ports.baxter}/?service=base`, mode: "shared" });
      this.baxter = pythonProgram("examples/baxter/baxter.py", ["--port", String(ports.baxter)]);
    }
    writeFileSync(
      file("gateway.json"),
      JSON.stringify({ listen: [`127.0.0.1:${ports.gateway}`], ["web_root"]: site, devices, access, ...more }),
    );
    this.url = `http://127.0.0.1:${ports.gateway}/`;
    this.create = new Program(deviceProgram("rrgate-demo-create"), ["--port", String(ports.create)]);
    this.gateway = new Program(rrgate, ["serve", "--config", file("gateway.json")]);
  }

  /** `more` is for the configuration, `device` for that of the robot. */
  static async start(
    site: string,
    { hasCamera = false, hasBaxter = false, device = {}, more = {} } = {},
  ): Promise<GuardedLab> {
    const ports: Ports = {
      create: await freePort(),
      gateway: await freePort(),
      webcams: hasCamera ? await freePort() : null,
      baxter: hasBaxter ? await freePort() : null,
    };
    const lab = new GuardedLab(ports, site, device, more);
    for (const program of [lab.create, lab.webcams, lab.baxter, lab.gateway]) program?.start();
    await lab.waitUntilOnline();
    return lab;
  }

  /** Until the gateway has reached all devices. */
  async waitUntilOnline(withinMs = 30_000): Promise<void> {
    const headers = { ["Authorization"]: `Bearer ${this.token}` };
    const giveUp = Date.now() + withinMs;
    for (;;) {
      const answer = await fetch(`${this.url}api/v1/devices`, { headers }).catch(() => null);
      const text = await answer?.text();
      if (text?.includes('"online"') && !/"(connecting|offline)"/.test(text)) return;
      if (Date.now() > giveUp) throw new Error(`not all are online: ${text}\n${this.gateway.output}`);
      await new Promise((resolve) => setTimeout(resolve, 100));
    }
  }

  async stop(): Promise<void> {
    await Promise.all(
      [this.gateway, this.create, this.webcams, this.baxter].map((program) => program?.kill("SIGTERM")),
    );
  }
}
