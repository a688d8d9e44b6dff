// The robot page under a finger, on a small screen.
import {
  expect,
  openRobot,
  poseOf,
  putAtStart,
  test,
  waitUntilMoved,
  waitUntilStill,
  waitUntilStopped,
} from "../lab_test";

test("a finger that holds drives, and nothing is wider than the screen", async ({ page, lab }) => {
  await openRobot(page, lab);
  const start = await putAtStart(page);
  const forward = page.getByRole("button", { name: "Forward" });
  await forward.scrollIntoViewIfNeeded();
  const box = await forward.boundingBox();
  if (!box) throw new Error("the button has no place on the page");
  expect(Math.min(box.width, box.height)).toBeGreaterThanOrEqual(44);

  const fingers = await page.context().newCDPSession(page);
  const point = { x: box.x + box.width / 2, y: box.y + box.height / 2 };
  await fingers.send("Input.dispatchTouchEvent", { type: "touchStart", touchPoints: [point] });
  await waitUntilMoved(page, start, 0.1);
  await fingers.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
  await waitUntilStopped(page);
  const end = await waitUntilStill(page);
  expect(end.x).toBeGreaterThan(start.x);
  expect((await poseOf(page)).x).toBe(end.x);

  const tooWide = await page.evaluate(
    () => document.documentElement.scrollWidth - document.documentElement.clientWidth,
  );
  expect(tooWide).toBe(0);
});
