// Which service the bar of a replay talks to.
import { controlAmong } from "../../web/src/pages/replay_bar";

test("the bar of a replay finds what controls it where replays were recorded, too", () => {
  const found = (...names: string[]) => controlAmong(names.map((name) => ({ name })))?.name;
  expect(found()).toBeUndefined();
  expect(found("replay")).toBe("replay");
  expect(found("replay", "replay_2")).toBe("replay_2");
  expect(found("replay_2", "replay_3")).toBe("replay_3");
  expect(found("replay_3")).toBe("replay_3"); // beside one of another type
  expect(found("replay_10", "player", "replay_9")).toBe("replay_10");
});
