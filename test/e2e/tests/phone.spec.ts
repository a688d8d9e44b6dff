// The robot page under a finger, on a small screen.
import { expect, open_robot, pose_of, put_at_start, test, wait_until_moved, wait_until_still, wait_until_stopped } from "../lab_test";

test("a finger that holds drives, and nothing is wider than the screen", async ({ page, lab }) => {
  await open_robot(page, lab);
  const start = await put_at_start(page);
  const forward = page.getByRole("button", { name: "Forward" });
  await forward.scrollIntoViewIfNeeded();
  const box = await forward.boundingBox();
  if (!box) throw new Error("the button has no place on the page");
  expect(Math.min(box.width, box.height)).toBeGreaterThanOrEqual(44);

  const fingers = await page.context().newCDPSession(page);
  const point = { x: box.x + box.width / 2, y: box.y + box.height / 2 };
  await fingers.send("Input.dispatchTouchEvent", { type: "touchStart", touchPoints: [point] });
  await wait_until_moved(page, start, 0.1);
  await fingers.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
  await wait_until_stopped(page);
  const end = await wait_until_still(page);
  expect(end.x).toBeGreaterThan(start.x);
  expect((await pose_of(page)).x).toBe(end.x);

  const too_wide = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
  expect(too_wide).toBe(0);
});
