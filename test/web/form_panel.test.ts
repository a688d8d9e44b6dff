// Fields for values: what stands in them over an outage.
import { clear, enter, find, press, settle, show, text } from "./shown";
import { memberOf } from "./members";
import { showPanel } from "./panels";
import { ObjectView } from "../../web/src/pages/object_view";
import type { ObjectViewProps } from "../../web/src/pages/object_view";
import FormPanel from "../../web/src/panels/form_panel";
import type { Member, Remote } from "../../web/src/robot/remote";

afterEach(clear);

const speed = memberOf("property", "double", "speed");
const showForm = (object: Remote, member: Member) => showPanel(FormPanel, object, [member]);

describe("a form of a property", () => {
  const connected = (value: number) => ({ get: () => Promise.resolve(value) }) as unknown as Remote;
  const start = () => showForm(connected(1), speed);
  const field = () => find<HTMLInputElement>("input.field");

  test("shows on each connection what the device has then", async () => {
    const update = start();
    await settle();
    expect(field().value).toBe("1");
    await update({ object: null });
    expect(field().value).toBe("1");
    await update({ object: connected(2), members: [{ ...speed }] });
    expect(field().value).toBe("2");
    await press("Read speed");
    await update({ object: connected(3) });
    expect(field().value).toBe("3");
  });

  test("keeps what was typed", async () => {
    const update = start();
    await settle();
    await enter(field(), "7");
    await update({ object: null });
    await update({ object: connected(2), members: [{ ...speed }] });
    expect(field().value).toBe("7");
  });

  test("has what was typed again when its type is what it was", async () => {
    const update = start();
    await settle();
    await enter(field(), "7");
    await update({ object: null, members: [{ ...speed, type: "string" }] });
    expect([field().value, text()]).toEqual(["", expect.stringContaining("its type has changed: speed")]);
    await update({ members: [speed] });
    expect([field().value, text()]).toEqual(["7", expect.not.stringContaining("has changed")]);
  });

  test("takes what was set before from the history, whatever the device has then", async () => {
    const set = vi.fn(() => Promise.resolve());
    const update = showForm({ ...connected(1), set }, speed);
    await settle();
    await enter(field(), "7");
    await press("Set speed");
    expect(set).toHaveBeenCalledWith("speed", 7, { timeout: 15_000 });
    await press("Read speed");
    expect(field().value).toBe("1");
    await press("7");
    await update({ object: connected(2) });
    expect(field().value).toBe("7");
  });
});

test("who has control waits for a long call by hand as long as others", async () => {
  const call = vi.fn(() => Promise.resolve(null));
  showForm({ call } as unknown as Remote, memberOf("function", "void", "home"));
  await settle();
  await press("Call home");
  expect(call).toHaveBeenCalledWith("home", [], { timeout: 15_000 });
});

describe("a row of a function", () => {
  const objectOf = (...names: string[]): Remote =>
    ({
      type: "a.B",
      members: [
        { ...memberOf("function", "void", "move"), parameters: names.map((name) => ({ name, type: "double" })) },
      ],
    }) as unknown as Remote;
  const texts = () => [...document.querySelectorAll<HTMLInputElement>("input")].map(({ value }) => value);

  test("keeps what was typed over an outage, but not for another parameter", async () => {
    const update = show(ObjectView, {
      object: objectOf("speed"),
      live: true,
      route: { path: [] },
    } as unknown as ObjectViewProps);
    await settle();
    await enter(find<HTMLInputElement>("input"), "5");
    await update({ object: objectOf("speed") });
    expect(texts()).toEqual(["5"]);
    await update({ object: objectOf("angle", "speed") });
    expect(texts()).toEqual(["", ""]);
  });
});
