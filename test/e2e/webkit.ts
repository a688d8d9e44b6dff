// Debian's WebKitGTK: Epiphany on a display of its own, by WebKitWebDriver. Source: w3.org/TR/webdriver2.
import { once } from "node:events";
import { request } from "node:http";
import type { IncomingMessage } from "node:http";
import { json } from "node:stream/consumers";
import { Family, keyActions, pointerActions, reach } from "./engine";
import type { Engine } from "./engine";
import { freePort } from "./processes";

/** Of a script: one is lost at times where a page has just begun. Source: WebDriver, 8.5. */
const timeouts = { script: 20_000 };
const browser = { binary: "/usr/bin/epiphany", args: ["--automation-mode"] };

/** What says `Bail out` at its start, as Epiphany does at times, is started again. */
export async function startWebkit(attempts = 5): Promise<Engine> {
  const port = await freePort();
  const screen = "-screen 0 1600x1200x24";
  const family = new Family(
    "xvfb-run",
    ["-a", "-s", screen, "dbus-run-session", "--", "WebKitWebDriver", `--port=${port}`],
    { ["WEBKIT_DISABLE_SANDBOX_THIS_IS_DANGEROUS"]: "1" }, // root has no user namespace to give
  );
  const send = async (method: string, path: string, body?: object): Promise<unknown> => {
    const asked = request({ host: "127.0.0.1", port, method, path, agent: false }); // it closes connections in use
    asked.end(body === undefined ? undefined : JSON.stringify(body));
    const [answer] = (await once(asked, "response")) as [IncomingMessage];
    const { value } = (await json(answer)) as { value: unknown };
    if (answer.statusCode !== 200) throw new Error(`${method} ${path}: ${JSON.stringify(value)}`);
    return value;
  };
  try {
    await reach(family, () => send("GET", "/status"));
    const capabilities = { alwaysMatch: { acceptInsecureCerts: true, timeouts, "webkitgtk:browserOptions": browser } };
    const { sessionId } = (await send("POST", "/session", { capabilities })) as { sessionId: string };
    const at = `/session/${sessionId}`;
    const run: Engine["run"] = async (source, args) => {
      const script = `const [args, tell] = arguments;
        (async () => JSON.stringify((await (${source})(...JSON.parse(args))) ?? null))().then(
          (value) => tell({ value }), (error) => tell({ error: String(error) }))`;
      const told = await send("POST", `${at}/execute/async`, { script, args: [JSON.stringify(args)] });
      const { value, error } = told as { value?: string; error?: string };
      if (value === undefined) throw new Error(error);
      return JSON.parse(value);
    };
    // Epiphany is never narrower than 500 pixels or so, and what stands around the page depends on the width.
    const resize: Engine["resize"] = async ({ width, height }) =>
      reach(family, async () => {
        const measure = "() => [innerWidth, innerHeight, outerWidth - innerWidth, outerHeight - innerHeight]";
        const [w, h, besideW, besideH] = (await run(measure, [])) as [number, number, number, number];
        if (Math.max(w, 520) === Math.max(width, 520) && h === height) return;
        await send("POST", `${at}/window/rect`, { width: width + besideW, height: height + besideH });
        throw new Error(`the page is ${w} x ${h}, not ${width} x ${height}`);
      });
    await resize({ width: 1280, height: 800 });
    return {
      open: async (url) => {
        await send("POST", `${at}/url`, { url });
        await reach(family, () => run("() => document.readyState", []));
      },
      run,
      pointer: async (...to) => void (await send("POST", `${at}/actions`, { actions: pointerActions(...to) })),
      key: async (...to) => void (await send("POST", `${at}/actions`, { actions: keyActions(...to) })),
      resize,
      close: async () => {
        await send("DELETE", at).catch(() => undefined); // says that there is no such window, and closes it
        await family.end();
      },
    };
  } catch (error) {
    await family.end();
    if (attempts <= 1) throw new Error(`${String(error)}\n${family.output}`);
    await new Promise((resolve) => setTimeout(resolve, 1_000));
    return startWebkit(attempts - 1);
  }
}
