// Values that are given to members in the list of an object: a property is set, a wire is sent to.
import { clear, enter, press, settle, show, text } from "./shown";
import { memberOf } from "./members";
import { remoteOf } from "./remotes";
import { ObjectView } from "../../web/src/pages/object_view";
import type { ObjectViewProps } from "../../web/src/pages/object_view";

afterEach(clear);

test("a value of the member's type is given, or it is said what is wrong with it", async () => {
  const members = ["speed", "velocity"].map((name, i) => ({
    ...memberOf(i === 0 ? "property" : "wire", "double", name),
    modifiers: ["writeonly"],
  }));
  const [set, poke] = [vi.fn(() => Promise.resolve()), vi.fn(() => Promise.reject(new Error("out of range")))];
  show(ObjectView, {
    object: { ...remoteOf(members), set, poke },
    live: true,
    route: { path: [] },
  } as unknown as ObjectViewProps);
  await settle();
  const [speed, velocity] = document.querySelectorAll<HTMLInputElement>("input.field");
  await enter(speed as HTMLInputElement, "7");
  await press("Set speed");
  expect(set).toHaveBeenCalledWith("speed", 7, { timeout: 15_000 });
  await enter(velocity as HTMLInputElement, "far");
  await press("Send velocity");
  expect(text()).toContain('"far" is not a number');
  expect(poke).not.toHaveBeenCalled();
  await enter(velocity as HTMLInputElement, "8");
  await press("Send velocity");
  expect(poke).toHaveBeenCalledWith("velocity", 8, { timeout: 15_000 });
  expect(text()).toContain("out of range");
});
