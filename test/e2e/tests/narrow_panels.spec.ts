// Panels of 200 px on a touch screen: each of their tools can be reached, by a finger and by keyboard.
import { expect, test } from "@playwright/test";
import type { Browser, Page } from "@playwright/test";
import { arrange } from "../board";
import { startPeer } from "../peers";
import { startTestService, webRoot } from "../processes";

const WIDTH_PX = 200;

/** A board of panels with three of its twelve columns each. */
function boardOf(kinds: Record<string, object>): string {
  const panels = Object.entries(kinds).map(([kind, settings], i) => ({
    ...{ kind, settings, x: (i % 4) * 3, y: Math.floor(i / 4) * 6, w: 3, h: 6 },
  }));
  return btoa(JSON.stringify({ board: 1, panels }));
}

async function openBoard(browser: Browser, address: string, kinds: Record<string, object>): Promise<Page> {
  const context = await browser.newContext({ viewport: { width: 900, height: 1000 }, hasTouch: true, isMobile: true });
  const page = await context.newPage();
  await page.goto(`${address}?view=board&board=${boardOf(kinds)}`);
  await expect(page.locator("[data-panel]")).toHaveCount(Object.keys(kinds).length);
  await expect(page.locator('[data-link="online"]')).toBeVisible();
  return page;
}

/** Which tools nobody can reach: what lies over them, or where they are cut off. */
function unreachable(page: Page): Promise<string[]> {
  return page.locator("[data-panel]").evaluateAll((panels) =>
    panels.flatMap((panel) => {
      const tools = panel.querySelectorAll<HTMLElement>("button, select, input, textarea, summary, a[href]");
      return [...tools].flatMap((tool) => {
        if (!tool.checkVisibility({ visibilityProperty: true })) return [];
        tool.scrollIntoView({ block: "nearest", inline: "nearest" }); // as focus does
        const { left, top, width, height } = tool.getBoundingClientRect();
        const there = document.elementFromPoint(left + width / 2, top + height / 2);
        const isHit = there && (tool.contains(there) || tool.closest("label")?.contains(there));
        // What is scrolled into view within something that a finger cannot scroll counts as cut off.
        let cut: Element | null = null;
        for (let each: Element | null = tool; each && each !== document.body; each = each.parentElement) {
          const { overflowX, overflowY } = getComputedStyle(each);
          if ((overflowX === "hidden" && each.scrollLeft > 0) || (overflowY === "hidden" && each.scrollTop > 0))
            cut = each;
          each.scrollTo(0, 0);
        }
        if (isHit && !cut && tool.tabIndex >= 0) return [];
        const what = tool.getAttribute("aria-label") ?? tool.textContent?.trim() ?? "";
        const where = cut
          ? `cut off by ${cut.className}`
          : `under ${there?.tagName ?? "nothing"} ${there?.className ?? ""}`;
        return [`${panel.getAttribute("data-panel") ?? ""}: ${tool.tagName} ${what}: ${where}`];
      });
    }),
  );
}

async function expectReachable(page: Page): Promise<void> {
  for (const each of await page.locator("[data-panel]").all())
    expect(Math.abs(((await each.boundingBox())?.width ?? 0) - WIDTH_PX)).toBeLessThan(10);
  await expect.poll(() => unreachable(page)).toEqual([]);
  await arrange(page);
  await expect(page.locator("[data-panel].is-arranged").first()).toBeVisible();
  await expect.poll(() => unreachable(page)).toEqual([]);
}

test("panels of members", async ({ browser }) => {
  const service = await startTestService(webRoot);
  try {
    const kinds = ["plot", "table", "image", "form", "log", "teleop", "pipe", "memory"];
    const more = ["generator", "streams", "locks", "notes"];
    const all = Object.fromEntries([...kinds, ...more].map((kind) => [kind, {}]));
    const page = await openBoard(browser, `${service.url}#/devices/big/interop`, all);
    await expectReachable(page);
    await page.context().close();
  } finally {
    await service.stop();
  }
});

test("panels of a robot", async ({ browser }) => {
  const robot = await startPeer("test/interop/peers/standard_robot.py", "robot");
  try {
    const waypoints = { waypoints: [{ seconds: 1, positions: [0.1, 0.2] }] };
    const kinds = { robot: {}, trajectory: waypoints, scene: { member: "robot_state" } };
    const page = await openBoard(browser, `${robot.url}#/devices/peer/robot`, kinds);
    await expect(page.getByRole("button", { name: "joint_1 forward" })).toBeAttached();
    await expectReachable(page);
    await page.context().close();
  } finally {
    await robot.stop();
  }
});

test("a robot's joints fit into its panel, however narrow", async ({ page }) => {
  const robot = await startPeer("test/interop/peers/standard_robot.py", "robot");
  try {
    await page.goto(`${robot.url}#/devices/peer/robot?view=board&board=${boardOf({ robot: {} })}`);
    await expect(page.getByRole("button", { name: "joint_1 forward" })).toBeVisible();
    const scroll = page.locator(".robot-panel");
    for (const width of [900, 1100, 1300, 1500, 1700, 1900]) {
      await page.setViewportSize({ width, height: 1000 });
      expect(await scroll.evaluate((each) => each.scrollWidth - each.clientWidth), `page of ${width} px`).toBe(0);
    }
  } finally {
    await robot.stop();
  }
});
