// What a person and a program can do in any browser: open an address, use pointer and keyboard, run a function in the page.
// firefox.ts speaks WebDriver BiDi, webkit.ts classic WebDriver; both know the same actions, and Chromium comes by Playwright.
import { chromium as playwright } from "@playwright/test";
import { spawn } from "node:child_process";
import type { ChildProcess } from "node:child_process";
import launch from "./chromium.json" with { type: "json" };

export type EngineName = "chromium" | "firefox" | "webkit";

export interface Size {
  width: number;
  height: number;
}

/** A certificate that nobody has signed is accepted. */
export interface Engine {
  open(url: string): Promise<void>;
  /** `source`: of a function, whose promise is awaited. @returns its result. @throws (rejects) what it throws. */
  run(source: string, args: readonly unknown[]): Promise<unknown>;
  pointer(what: "down" | "up", x: number, y: number): Promise<void>;
  /** As WebDriver names them: a character, or one of `KEYS`. */
  key(what: "down" | "up", key: string): Promise<void>;
  resize(size: Size): Promise<void>;
  close(): Promise<void>;
}

/** Keys without a character. Source: WebDriver, 17.4.2. */
export const KEYS = { ["Enter"]: "\uE007", ["ArrowUp"]: "\uE013" } as const;

export async function startChromium(): Promise<Engine> {
  const executablePath = process.env["CHROMIUM"] ?? launch.executablePath;
  const browser = await playwright.launch({ ...launch, executablePath });
  const page = await browser.newPage({ ignoreHTTPSErrors: true, viewport: { width: 1280, height: 800 } });
  const named = (key: string): string => Object.entries(KEYS).find(([, code]) => code === key)?.[0] ?? key;
  return {
    open: async (url) => void (await page.goto(url)),
    run: async (source, args) => page.evaluate(`(${source})(...${JSON.stringify(args)})`),
    pointer: async (what, x, y) => {
      await page.mouse.move(x, y);
      await page.mouse[what]();
    },
    key: async (what, key) => page.keyboard[what](named(key)),
    resize: async (size) => page.setViewportSize(size),
    close: async () => browser.close(),
  };
}

/** The sources of actions of both WebDrivers. */
export function pointerActions(what: "down" | "up", x: number, y: number): object[] {
  const move = { type: "pointerMove", x: Math.round(x), y: Math.round(y), duration: 0, origin: "viewport" };
  const button = { type: what === "down" ? "pointerDown" : "pointerUp", button: 0 };
  return [{ type: "pointer", id: "mouse", parameters: { pointerType: "mouse" }, actions: [move, button] }];
}

export function keyActions(what: "down" | "up", key: string): object[] {
  return [{ type: "key", id: "keyboard", actions: [{ type: what === "down" ? "keyDown" : "keyUp", value: key }] }];
}

/** A browser and all that it starts: its own group of processes. */
export class Family {
  readonly #child: ChildProcess;
  #output = "";

  constructor(file: string, args: readonly string[], environment: Readonly<Record<string, string>> = {}) {
    const env = { ...process.env, ...environment };
    this.#child = spawn(file, args, { detached: true, env, stdio: ["ignore", "pipe", "pipe"] });
    const keep = (chunk: Buffer): void => void (this.#output = (this.#output + chunk.toString()).slice(-8_000));
    this.#child.stdout?.on("data", keep);
    this.#child.stderr?.on("data", keep);
    this.#child.on("error", (error) => (this.#output += String(error)));
  }

  get output(): string {
    return this.#output;
  }

  get hasEnded(): boolean {
    return this.#child.pid === undefined || this.#child.exitCode !== null || this.#child.signalCode !== null;
  }

  /** In order, as far as it comes within two seconds. */
  async end(): Promise<void> {
    const ended = new Promise((resolve) => this.#child.once("exit", resolve));
    if (!this.hasEnded && this.#signal("SIGTERM"))
      await Promise.race([ended, new Promise((resolve) => setTimeout(resolve, 2_000))]);
    this.#signal("SIGKILL");
  }

  /** @returns false where all have ended. */
  #signal(signal: NodeJS.Signals): boolean {
    try {
      return this.#child.pid !== undefined && process.kill(-this.#child.pid, signal);
    } catch (error) {
      if ((error as NodeJS.ErrnoException).code !== "ESRCH") throw error;
      return false;
    }
  }
}

/** Until `attempt` succeeds: a browser that has just been started does not listen yet. */
export async function reach<T>(family: Family, attempt: () => Promise<T>, withinMs = 20_000): Promise<T> {
  const giveUp = Date.now() + withinMs;
  for (;;) {
    try {
      return await attempt();
    } catch (error) {
      if (family.hasEnded || Date.now() > giveUp)
        throw new Error(`${String(error)}\nits browser wrote:\n${family.output}`, { cause: error });
      await new Promise((resolve) => setTimeout(resolve, 50));
    }
  }
}
