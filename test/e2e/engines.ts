// The same tests in three engines, each of which is started once for them.
import { test } from "@playwright/test";
import { startChromium } from "./engine";
import type { Engine } from "./engine";
import { startFirefox } from "./firefox";
import { lacks } from "./machine";
import { Visitor } from "./visitor";
import { startWebkit } from "./webkit";

const engines: Readonly<Record<string, { start: () => Promise<Engine>; needs?: string }>> = {
  ["Chromium"]: { start: startChromium },
  ["Firefox"]: { start: startFirefox, needs: "firefox" },
  ["WebKit"]: { start: startWebkit, needs: "webkit" },
};

/** `declare`: the tests of one engine; who is at it is there while they run. */
export function inEachEngine(declare: (visitor: () => Visitor) => void): void {
  for (const [name, { start, needs }] of Object.entries(engines)) {
    test.describe(name, () => {
      const lacking = needs === undefined ? null : lacks(needs);
      test.skip(lacking !== null, `needs ${needs}: ${lacking}`);
      let engine: Engine;

      test.beforeAll(async () => {
        engine = await start();
      });

      test.afterAll(() => engine?.close());

      declare(() => new Visitor(engine));
    });
  }
}
