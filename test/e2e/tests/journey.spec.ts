// Somebody who has only the URL, in three engines.
import { expect, test } from "@playwright/test";
import { inEachEngine } from "../engines";
import { GuardedLab, password } from "../guarded_lab";
import { startNginx } from "../nginx";
import type { Nginx } from "../nginx";
import { startPeer } from "../peers";
import type { Peer } from "../peers";
import { Lab, webRoot } from "../processes";
import { button, field, link } from "../visitor";
import type { Visitor } from "../visitor";

const phone = [412, 839] as const;

let lab: GuardedLab;
let nginx: Nginx;
/** Without users, where the robot is commanded under a lease. */
let demo: Lab;
let hostile: Peer;

test.beforeAll(async () => {
  lab = await GuardedLab.start(webRoot, {
    hasCamera: true,
    hasBaxter: true,
    more: { ["trusted_proxies"]: ["127.0.0.1"] },
  });
  nginx = await startNginx(Number(new URL(lab.url).port));
  demo = await Lab.start();
  hostile = await startPeer("test/e2e/peers/hostile.py", "hostile");
});

test.afterAll(() => Promise.all([nginx?.stop(), lab?.stop(), demo?.stop(), hostile?.stop()]));

async function signIn(visitor: Visitor): Promise<void> {
  await visitor.write(field("Name"), "root");
  await visitor.write(field("Password or token"), password);
  await visitor.press(button("Sign in"));
}

/** The board as it is kept, by its address alone. */
async function openOnPhone(visitor: Visitor): Promise<void> {
  await visitor.see({ css: '[data-kept="true"]' });
  const address = await visitor.run(() => location.href);
  expect(address).toContain("&board=");
  expect(await visitor.complaints()).toEqual([]);
  await visitor.open("about:blank");
  await visitor.resize(...phone);
  await visitor.open(address);
}

inEachEngine((at) => {
  test("with only the URL: signs in, jogs joint 3, watches camera and plot, keeps the board, opens it on a phone", async () => {
    const visitor = at();
    test.slow(); // the whole way of a person, in a browser that may be slow
    await visitor.open(lab.url);
    await signIn(visitor);
    await visitor.press({ css: '[data-device="baxter"] a.service[href$="left_arm"]' });

    await visitor.see({ css: '[data-link="online"]' });
    await visitor.press(button("Jog"));
    const third = { css: '[data-joint="2"] .joint-value' };
    const letGo = await visitor.hold(button("left_e0 forward"));
    await visitor.see(third, /^0\.0*[1-9]/);
    await letGo();
    await visitor.see({ css: '[data-joint="0"] .joint-value' }, /^0\.0000 rad$/);
    const jogged = await visitor.settled(third);

    await visitor.see({ css: '[data-panel="plot"] .u-wrap canvas' });
    await visitor.see({ css: '[data-panel="plot"] .freshness' }, /a second/);
    await visitor.press(button("Arrange"));
    await visitor.choose(field("Kind of panel"), "image");
    await visitor.press(button("Add panel"));
    await visitor.choose({ css: '[data-panel="image"] .panel-source select' }, "baxter/head_camera");
    await visitor.choose({ css: '[data-panel="image"] .panel-tools select' }, "frame_stream");
    await visitor.press(button("Done"));
    const picture = '[data-panel="image"] canvas';
    await expect.poll(() => visitor.run(coloursOf, picture)).toBeGreaterThan(3);
    await openOnPhone(visitor);
    await visitor.see(third, new RegExp(`^${jogged}$`));
    await visitor.see({ css: '[data-panel="plot"] .freshness' }, /a second/);
    await expect.poll(() => visitor.run(coloursOf, picture)).toBeGreaterThan(3);
    expect(await visitor.run(() => document.documentElement.scrollWidth - innerWidth)).toBeLessThanOrEqual(0);
    await visitor.press(button("Stop"));
    await visitor.see({ css: '[data-stop="arrived"]' }, /^arrived after \d+ ms/);
    await visitor.see({ css: ".robot-words" }, /halt/);
    expect(await visitor.complaints()).toEqual([]);
    await visitor.press(button("Sign out"));
    await visitor.see(button("Sign in"));
    await visitor.resize(1280, 800);
  });

  test("signs in, drives, looks at camera and plot, makes a board, and opens it on a phone", async () => {
    const visitor = at();
    await visitor.open(lab.url);
    await signIn(visitor);
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
    await visitor.press(button("Arrange"));
    await visitor.choose(field("Kind of panel"), "notes");
    await visitor.press(button("Add panel"));
    await visitor.write({ css: '[data-panel="notes"] textarea' }, "call Vera");
    await visitor.press(button("Done"));
    await openOnPhone(visitor);
    await visitor.see({ css: '[data-panel="plot"] .freshness' }, /a second/);
    const note = () => visitor.run(() => document.querySelector<HTMLTextAreaElement>(".board textarea")?.value);
    await expect.poll(note).toBe("call Vera");
    expect(await visitor.run(() => document.documentElement.scrollWidth - innerWidth)).toBeLessThanOrEqual(0);
    await visitor.press(button("Stop"));
    await visitor.see({ css: '[data-stop="arrived"]' }, /^arrived after \d+ ms/);
    expect(await visitor.complaints()).toEqual([]);
  });

  test("behind nginx, by https and wss, at its root and below a path: signs in, drives, stops", async () => {
    const visitor = at();
    for (const site of [nginx.root, nginx.below]) {
      await visitor.open(site);
      await visitor.write(field("Name"), "root");
      await visitor.write(field("Password or token"), password);
      await visitor.press(button("Sign in"));
      await visitor.press({ css: '[data-device="create"] a.service' });
      await visitor.see({ css: '[data-link="online"]' });
      const letGo = await visitor.hold(button("Forward"));
      await visitor.see({ css: '[data-reading="left-wheel"]' }, /^[1-9]/);
      await letGo();
      await visitor.see({ css: '[data-reading="left-wheel"]' }, /^0$/);
      expect((await drive(60)).ok).toBe(true); // somebody else drives
      await visitor.see({ css: '[data-reading="left-wheel"]' }, /^60$/);
      await visitor.press(button("Stop"));
      await visitor.see({ css: '[data-reading="left-wheel"]' }, /^0$/);
      await visitor.press(button("Sign out"));
      await visitor.see({ css: "form.sign-in" });
      expect(await visitor.complaints()).toEqual([]);
    }
  });

  test("Stop is sent past a call that hangs, and its arrival is said", async () => {
    const visitor = at();
    await visitor.resize(1280, 800);
    await visitor.open(`${demo.url}#/devices/create/Create?view=board`);
    await visitor.see({ css: '[data-link="online"]' });
    await visitor.choose({ css: '[data-panel="form"] select' }, "Drive");
    await visitor.see(button("Call Drive"));
    demo.create.signal("SIGSTOP"); // calls hang from here on
    try {
      await visitor.press(button("Call Drive"));
      await visitor.run(() => {
        const said: string[] = [];
        Object.assign(window, { said });
        const look = () => said.push(document.querySelector<HTMLElement>("[data-stop]")?.dataset["stop"] ?? "");
        new MutationObserver(look).observe(document, { attributeFilter: ["data-stop"], subtree: true });
      });
      await visitor.press(button("Stop"));
      // It waits for 2 s, which this test may miss on a busy machine.
      const said = () => visitor.run(() => (window as unknown as { said: string[] }).said);
      await expect.poll(said).toContain("sent");
    } finally {
      demo.create.signal("SIGCONT");
    }
    await visitor.see({ css: "[data-stop]" }, /^(arrived|NOT STOPPED)/);
    // One that had waited for too long before the device went on has failed for good: each press sends again.
    if (await visitor.run(() => document.querySelector('[data-stop="failed"]') !== null)) {
      await visitor.press(button("Stop"));
    }
    await visitor.see({ css: '[data-stop="arrived"]' }, /^arrived after \d+ ms/);
    expect(await visitor.complaints()).toEqual([]);
  });

  test("a page that hangs, or is left, drives no more", async () => {
    const visitor = at();
    await visitor.resize(1280, 800);
    const drive = async (): Promise<() => Promise<void>> => {
      await visitor.open("about:blank"); // else the page stays, and what it has lost
      await visitor.open(`${demo.url}#/devices/create/Create`);
      await visitor.see({ css: '[data-link="online"]' });
      await visitor.press(button("To start"));
      await visitor.see({ css: '[data-pose="x"]' }, /^0\.000 m/);
      await visitor.see(button("Forward"));
      const letGo = await visitor.holdKey("ArrowUp");
      await expect.poll(speed).toBeGreaterThan(0);
      return letGo;
    };
    const letGo = await drive();
    const hung = visitor.run(() => {
      const until = Date.now() + 10_000;
      while (Date.now() < until);
    });
    await expect.poll(speed, { intervals: [50], timeout: 8_000 }).toBe(0);
    await hung;
    await visitor.see({ css: '[data-control="lost"]' }, /has not renewed it/);
    await letGo();
    expect(await visitor.complaints()).toEqual([]);
    await drive();
    await visitor.open("about:blank");
    await expect.poll(speed, { intervals: [50], timeout: 10_000 }).toBe(0);
  });

  test("names and texts of a hostile service are shown among all members, and nothing of them runs", async () => {
    const visitor = at();
    await visitor.open(`${hostile.url}#/devices/peer/hostile?view=members`);
    await visitor.see({ css: '[data-member="then"]' }, /<img src=x/);
    await visitor.see({ css: '[data-member="constructor"]' }, /<img src=x/);
    await visitor.see({ css: '[data-member="toString"]' });
    const found = () => [document.title, document.querySelectorAll("main :is(img, script)").length];
    expect(await visitor.run(found)).toEqual(["peer · rrgate", 0]);
    expect(await visitor.complaints()).toEqual([]);
  });
});

/** Of the demo's robot, in m/s, by the gateway. */
async function speed(): Promise<number> {
  const state = (await (await fetch(`${demo.url}api/v1/devices/create/Create/state`)).json()) as { velocity: number };
  return state.velocity;
}

/** By a program, straight ahead. */
async function drive(velocity: number): Promise<Response> {
  return fetch(`${lab.url}api/v1/devices/create/Create/Drive`, {
    method: "POST",
    headers: { Authorization: `Bearer ${lab.token}`, ["Content-Type"]: "application/json" },
    body: JSON.stringify({ velocity, radius: 32767 }),
  });
}

/** Runs in the page: of a canvas that others draw on, how many different pixels it has. */
function coloursOf(css: string): number {
  const canvas = document.querySelector<HTMLCanvasElement>(css);
  const pixels = canvas?.getContext("2d")?.getImageData(0, 0, canvas.width, canvas.height).data ?? [];
  return new Set(Array.from(pixels).filter((_, index) => index % 4 === 0)).size;
}
