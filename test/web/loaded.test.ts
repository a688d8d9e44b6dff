// Parts of the page that are loaded when they are looked at, from a gateway that is away meanwhile.
import { clear, show, text } from "./shown";
import { loaded } from "../../web/src/ui/loaded";

beforeEach(() => void vi.useFakeTimers());
afterEach(() => {
  clear();
  vi.useRealTimers();
});

const turn = () => vi.advanceTimersByTimeAsync(0);

test("a part that the gateway did not send is asked for again, later and later, and shown once it comes", async () => {
  const load = vi.fn(() => Promise.reject(new Error("away")));
  const part = { default: ({ name }: { name: string }) => `here is ${name}` };
  const Part = loaded<{ name: string }>(load);
  show(Part, { name: "the list" });
  await turn();
  expect(text()).toContain("The gateway has not sent this part of the page yet");
  await vi.advanceTimersByTimeAsync(999);
  expect(load).toHaveBeenCalledTimes(1);
  await vi.advanceTimersByTimeAsync(1);
  expect(load).toHaveBeenCalledTimes(2);
  await vi.advanceTimersByTimeAsync(2_000 + 4_000 + 8_000 + 16_000 + 30_000);
  expect(load).toHaveBeenCalledTimes(7);
  expect(Part.isThere.value).toBe(false);
  load.mockResolvedValue(part as never);
  await vi.advanceTimersByTimeAsync(30_000);
  expect(text()).toBe("here is the list");
  expect(Part.isThere.value).toBe(true);
});

test("a part that nobody looks at any more is not asked for", async () => {
  const load = vi.fn(() => Promise.reject(new Error("away")));
  show(loaded(load), {});
  await turn();
  clear();
  await vi.advanceTimersByTimeAsync(300_000);
  expect(load).toHaveBeenCalledOnce();
});
