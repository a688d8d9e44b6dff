// `test` with a running lab, a page that may not complain, and the readings of the robot page.
import { test as base, expect } from "@playwright/test";
import type { Locator, Page } from "@playwright/test";
import { Lab } from "./processes";

export { expect };

export const test = base.extend<{ quiet: void }, { lab: Lab }>({
  lab: [
    async ({}, use) => {
      const lab = await Lab.start();
      await use(lab);
      await lab.stop();
    },
    { scope: "worker" },
  ],
  /** Fails a test whose page threw an error or broke its content security policy. */
  quiet: [
    async ({ page }, use) => {
      const complaints: string[] = [];
      page.on("pageerror", (error) => complaints.push(String(error)));
      page.on("console", (message) => {
        if (message.type() === "error" && /Content Security Policy/.test(message.text()))
          complaints.push(message.text());
      });
      await use();
      expect(complaints).toEqual([]);
    },
    { auto: true },
  ],
});

export interface Pose {
  x: number;
  y: number;
  heading: number;
}

export async function poseOf(page: Page): Promise<Pose> {
  const read = async (name: string): Promise<number> =>
    Number.parseFloat(await page.locator(`[data-pose="${name}"]`).innerText());
  return { x: await read("x"), y: await read("y"), heading: await read("heading") };
}

export function distance(a: Pose, b: Pose): number {
  return Math.hypot(a.x - b.x, a.y - b.y);
}

export async function openRobot(page: Page, gateway: { url: string }): Promise<void> {
  await page.goto(`${gateway.url}#/devices/create/Create`);
  await expect(page.locator('[data-link="online"]')).toBeVisible();
  await expect(page.getByRole("button", { name: "Forward" })).toBeEnabled();
}

/** Until two looks 400 ms apart show the same place. */
export async function waitUntilStill(page: Page): Promise<Pose> {
  let before: Pose | null = null; // the first look has nothing to compare with: two are an interval apart
  await expect(async () => {
    const now = await poseOf(page);
    const moved = before ? distance(before, now) : Infinity;
    before = now;
    expect(moved).toBeLessThan(0.0005);
  }).toPass({ intervals: [400] });
  return before as unknown as Pose;
}

/** Until the robot is further than `metres` from where it was. */
export async function waitUntilMoved(page: Page, from: Pose, metres: number): Promise<Pose> {
  let now = from;
  await expect(async () => {
    now = await poseOf(page);
    expect(distance(from, now)).toBeGreaterThan(metres);
  }).toPass({ intervals: [100] });
  return now;
}

/**
 * Until the robot tells of wheels that turn, or of none that does. A wall keeps the robot in its place, not its wheels: who
 * wants to see that it was told to stop looks at them.
 */
export async function waitUntilDriving(page: Page): Promise<void> {
  await expect(wheel(page, "left")).not.toHaveText(/^[0–]$/);
}

export async function waitUntilStopped(page: Page, withinMs?: number): Promise<void> {
  for (const side of ["left", "right"] as const) await expect(wheel(page, side)).toHaveText("0", { timeout: withinMs });
}

function wheel(page: Page, side: "left" | "right"): Locator {
  return page.locator(`[data-reading="${side}-wheel"]`);
}

export async function putAtStart(page: Page): Promise<Pose> {
  await page.getByRole("button", { name: "To start" }).click();
  await expect(page.locator('[data-pose="x"]')).toHaveText("0.000 m");
  return waitUntilStill(page);
}
