// The dashboard and the client in three engines: somebody who has only the URL, and a program that uses every way to a device.
import { execFileSync } from "node:child_process";
import { cpSync, mkdtempSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";
import { expect, test } from "@playwright/test";
import { startChromium } from "../engine";
import type { Engine } from "../engine";
import { startFirefox } from "../firefox";
import { GuardedLab, password } from "../guarded_lab";
import { startPeer } from "../peers";
import type { Peer } from "../peers";
import { repositoryRoot, rrgate, startTestService, webRoot } from "../processes";
import { lacks } from "../machine";
import { button, field, link, Visitor } from "../visitor";
import { startWebkit } from "../webkit";

const engines: Readonly<Record<string, { start: () => Promise<Engine>; needs?: string }>> = {
  ["Chromium"]: { start: startChromium },
  ["Firefox"]: { start: startFirefox, needs: "firefox" },
  ["WebKit"]: { start: startWebkit, needs: "webkit" },
};

const phone = [412, 839] as const;

let lab: GuardedLab;
let arm: Peer;
let service: Awaited<ReturnType<typeof startTestService>>;

/** The client as it is published, an empty page, and a certificate: the gateway's port takes both ws and wss. */
async function startClientSite(): Promise<typeof service> {
  const site = mkdtempSync(path.join(tmpdir(), "rrgate-site-"));
  cpSync(path.join(repositoryRoot, "wasm-client/dist"), site, { recursive: true });
  writeFileSync(path.join(site, "index.html"), "<!doctype html><title>client</title>");
  const keys = mkdtempSync(path.join(tmpdir(), "rrgate-tls-"));
  execFileSync(rrgate, ["cert", "ca", keys]);
  execFileSync(rrgate, ["cert", "web", keys, "127.0.0.1"]);
  const file = (end: string): string => path.join(keys, `127.0.0.1.${end}`);
  return startTestService(site, () => ({ tls: { certificates: [{ cert: file("pem"), key: file("key") }] } }));
}

test.beforeAll(async () => {
  [lab, arm, service] = await Promise.all([
    GuardedLab.start(webRoot, { hasCamera: true }),
    startPeer("test/interop/peers/standard_robot.py", "robot"),
    startClientSite(),
  ]);
});

test.afterAll(() => Promise.all([lab?.stop(), arm?.stop(), service?.stop()]));

for (const [name, { start, needs }] of Object.entries(engines)) {
  test.describe(name, () => {
    const lacking = needs === undefined ? null : lacks(needs);
    test.skip(lacking !== null, `needs ${needs}: ${lacking}`);
    let engine: Engine;
    let visitor: Visitor;

    test.beforeAll(async () => {
      engine = await start();
      visitor = new Visitor(engine);
    });

    test.afterAll(() => engine?.close());

    test("jogs a joint of a standard robot while a button is held, and stops it", async () => {
      await visitor.open(`${arm.url}#/devices/peer/robot`);
      await visitor.see({ css: ".robot-words" });
      await visitor.press(button("Jog"));
      const letGo = await visitor.hold(button("joint_1 forward"));
      await visitor.see({ css: '[data-joint="1"] .joint-value' }, /^0\.0*[1-9]/);
      await letGo();
      await visitor.see({ css: '[data-joint="0"] .joint-value' }, /^0 rad$/);
      await visitor.press(button("Stop"));
      await visitor.see({ css: '[data-stop="arrived"]' });
      expect(await visitor.complaints()).toEqual([]);
    });

    test("signs in, drives, looks at camera and plot, makes a board, and opens it on a phone", async () => {
      await visitor.open(lab.url);
      await visitor.write(field("Name"), "root");
      await visitor.write(field("Password or token"), password);
      await visitor.press(button("Sign in"));
      await visitor.press({ css: '[data-device="create"] a.service' });

      await visitor.see({ css: '[data-link="online"]' });
      for (const hold of [() => visitor.hold(button("Forward")), () => visitor.holdKey("ArrowUp")]) {
        const letGo = await hold();
        await visitor.see({ css: '[data-reading="left-wheel"]' }, /^[1-9]/);
        await letGo();
        await visitor.see({ css: '[data-reading="left-wheel"]' }, /^0$/);
      }
      await expect.poll(() => visitor.run(coloursOf, ".camera canvas")).toBeGreaterThan(3);

      await visitor.press(link("Board"));
      await visitor.see({ css: '[data-panel="plot"] .u-wrap canvas' });
      await visitor.see({ css: '[data-panel="plot"] .freshness' }, /a second/);
      await visitor.choose(field("Kind of panel"), "notes");
      await visitor.press(button("Add panel"));
      await visitor.write({ css: '[data-panel="notes"] textarea' }, "call Vera");
      await visitor.press(button("Done"));
      await visitor.see({ css: '[data-kept="true"]' });
      const address = await visitor.run(() => location.href);
      expect(address).toContain("&board=");
      expect(await visitor.complaints()).toEqual([]);

      await visitor.open("about:blank");
      await visitor.resize(...phone);
      await visitor.open(address);
      await visitor.see({ css: '[data-panel="plot"] .freshness' }, /a second/);
      const note = () => visitor.run(() => document.querySelector<HTMLTextAreaElement>(".board textarea")?.value);
      await expect.poll(note).toBe("call Vera");
      expect(await visitor.run(() => document.documentElement.scrollWidth - innerWidth)).toBeLessThanOrEqual(0);
      await visitor.press(button("Stop"));
      await visitor.see({ css: '[data-stop="arrived"]' }, /^arrived after \d+ ms/);
      expect(await visitor.complaints()).toEqual([]);
    });

    for (const [scheme, entry, how] of [
      ["http", "index.js", "ws"],
      ["https", "index.js", "wss"],
      ["http", "worker.js", "ws in a worker"],
      ["https", "worker.js", "wss in a worker"],
    ] as const) {
      test(`the client calls, reads, listens and sends by ${how}`, async () => {
        await visitor.open(service.url.replace("http", scheme));
        expect(await visitor.run(useAllMembers, entry)).toEqual({
          called: 5,
          refused: "not today",
          set: "für alle",
          wire: [1, 2, 3],
          event: [0, "number 0"],
          pipe: [2, 4],
          generated: [1, 2, 3],
          memory: 3,
          state: "closed",
        });
      });
    }
  });
}

/** Runs in the page: of a canvas that others draw on, how many different pixels it has. */
function coloursOf(css: string): number {
  const canvas = document.querySelector<HTMLCanvasElement>(css);
  const pixels = canvas?.getContext("2d")?.getImageData(0, 0, canvas.width, canvas.height).data ?? [];
  return new Set(Array.from(pixels).filter((_, index) => index % 4 === 0)).size;
}

/** Runs in the page. `entry`: of the client. */
async function useAllMembers(entry: string): Promise<object> {
  const { connect } = await import(new URL(entry, location.href).href);
  const device = await connect(new URL("/devices/big?service=interop", location.href));
  const called: number = await device.add(2, 3);
  const refused: string = await device.fail("custom", "not today").catch((error: Error) => error.message);
  await device.p_string.set("für alle");
  const set: string = await device.p_string.get();
  const state = device.state.connect();
  await state.ready;
  await device.publish_state([1, 2, 3]);
  const wire = Array.from((await state[Symbol.asyncIterator]().next()).value as Float64Array);
  const end = await device.doubled.connect();
  const packets = end[Symbol.asyncIterator]();
  await end.send(1);
  await end.send(2);
  const pipe = [(await packets.next()).value, (await packets.next()).value];
  const changed = device.changed.once();
  await device.fire(1);
  const event: unknown[] = await changed;
  const generated: unknown[] = [];
  for await (const number of device.count_up(1, 3)) generated.push(number);
  const memory = (await device.m_numbers.read(0, 3)).length;
  await device.$.close();
  return { called, refused, set, wire, event, pipe, generated, memory, state: device.$.state };
}
