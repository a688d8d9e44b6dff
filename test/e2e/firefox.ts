// Debian's Firefox by WebDriver BiDi, which it speaks itself. Source: w3.org/TR/webdriver-bidi.
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";
import { WebSocket } from "ws";
import { Family, keyActions, pointerActions, reach } from "./engine";
import type { Engine } from "./engine";
import { freePort } from "./processes";

export const program = process.env["FIREFOX"] ?? "/usr/bin/firefox-esr";

type Answer = Record<string, unknown>;

export async function startFirefox(): Promise<Engine> {
  const port = await freePort();
  const profile = mkdtempSync(path.join(tmpdir(), "rrgate-firefox-"));
  const family = new Family(program, [
    "--headless",
    "--no-remote",
    "--profile",
    profile,
    `--remote-debugging-port=${port}`,
  ]);
  const close = async (): Promise<void> => {
    await family.end();
    rmSync(profile, { recursive: true, force: true, maxRetries: 5, retryDelay: 100 });
  };
  try {
    const bidi = await reach(family, () => Bidi.open(`ws://127.0.0.1:${port}/session`));
    await bidi.send("session.new", { capabilities: { alwaysMatch: { acceptInsecureCerts: true } } });
    const { contexts } = (await bidi.send("browsingContext.getTree", {})) as { contexts: { context: string }[] };
    const context = contexts[0]?.context;
    await bidi.send("browsingContext.setViewport", { context, viewport: { width: 1280, height: 800 } });
    return {
      open: async (url) => void (await bidi.send("browsingContext.navigate", { context, url, wait: "complete" })),
      run: async (source, args) => {
        const functionDeclaration = `async (args) => JSON.stringify((await (${source})(...JSON.parse(args))) ?? null)`;
        const given = [{ type: "string", value: JSON.stringify(args) }];
        const call = { functionDeclaration, arguments: given, awaitPromise: true, target: { context } };
        const { result, exceptionDetails } = (await bidi.send("script.callFunction", call)) as {
          result?: { value: string };
          exceptionDetails?: { text: string };
        };
        if (!result) throw new Error(exceptionDetails?.text);
        return JSON.parse(result.value);
      },
      pointer: async (...to) =>
        void (await bidi.send("input.performActions", { context, actions: pointerActions(...to) })),
      key: async (...to) => void (await bidi.send("input.performActions", { context, actions: keyActions(...to) })),
      resize: async (viewport) => void (await bidi.send("browsingContext.setViewport", { context, viewport })),
      close,
    };
  } catch (error) {
    await close();
    throw error;
  }
}

/** Commands and their answers; events are not asked for. */
class Bidi {
  readonly #socket: WebSocket;
  readonly #waiting = new Map<number, (answer: Answer) => void>();
  #last = 0;

  private constructor(socket: WebSocket) {
    this.#socket = socket;
    socket.on("message", (data) => {
      const answer = JSON.parse(String(data)) as Answer;
      this.#waiting.get(answer["id"] as number)?.(answer);
      this.#waiting.delete(answer["id"] as number);
    });
    socket.on("close", () => {
      for (const tell of this.#waiting.values()) tell({ error: "closed", message: "Firefox has closed its socket" });
    });
  }

  static async open(url: string): Promise<Bidi> {
    const socket = new WebSocket(url);
    await new Promise((resolve, reject) => socket.once("open", resolve).once("error", reject));
    return new Bidi(socket);
  }

  async send(method: string, params: object): Promise<unknown> {
    const id = ++this.#last;
    const answer = await new Promise<Answer>((resolve) => {
      this.#waiting.set(id, resolve);
      this.#socket.send(JSON.stringify({ id, method, params }));
    });
    if (answer["error"] !== undefined)
      throw new Error(`${method}: ${String(answer["error"])}: ${String(answer["message"])}`);
    return answer["result"];
  }
}
