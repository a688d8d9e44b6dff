// What was written is not said to have failed because it could not be read back.
import { button, clear, enter, find, press, settle, show, text } from "./shown";
import { memberOf } from "./members";
import { PropertyRow } from "../../web/src/members/property_row";
import type { MemberRowProps } from "../../web/src/members/row";
import MemoryPanel from "../../web/src/panels/memory_panel";
import type { PanelProps } from "../../web/src/panels/panel";
import type { Remote } from "../../web/src/robot/remote";

afterEach(clear);

const SIZE = 512;

const makeMemory = () => ({
  dimensions: () => Promise.resolve([SIZE]),
  read: vi.fn((_: string, [at = 0]: number[], [count = 0]: number[]) =>
    at + count > SIZE ? Promise.reject(new Error("beyond the end")) : Promise.resolve(new Uint8Array(count)),
  ),
  write: vi.fn(() => Promise.resolve()),
});

async function showMemory(object: ReturnType<typeof makeMemory>, ...modifiers: string[]) {
  show(MemoryPanel, {
    object: object as unknown as Remote,
    members: [{ ...memberOf("memory", "uint8[]", "store"), modifiers }],
    place: { device: "d", service: "s", object: "" },
    settings: {},
    change: () => undefined,
  } as unknown as PanelProps);
  await settle();
}

const fields = () => [...document.querySelectorAll<HTMLInputElement>("input.field")];
const writeForm = () => [...document.querySelectorAll("form")].at(-1);

describe("items of a memory", () => {
  test("that were written are so, also where what was asked to be read goes past the end", async () => {
    const object = makeMemory();
    await showMemory(object);
    const [position, , items] = fields();
    await enter(position as HTMLInputElement, "500");
    await enter(items as HTMLInputElement, "7");
    await press("Write");
    expect(object.write).toHaveBeenCalledWith("store", [500], new Uint8Array([7]));
    expect(object.read).toHaveBeenCalledWith("store", [500], [256]);
    expect(writeForm()?.textContent).toContain("done");
    expect(text()).toMatch(/beyond the end.*New items/); // at what was read
  });

  test("that cannot be read are written and not asked for", async () => {
    const object = makeMemory();
    await showMemory(object, "writeonly");
    expect(button("Read").disabled).toBe(true);
    await enter(fields()[2] as HTMLInputElement, "7");
    await press("Write");
    expect(writeForm()?.textContent).toContain("done");
    expect(object.read).not.toHaveBeenCalled();
  });

  test("that were refused are not said to be written", async () => {
    const object = makeMemory();
    await showMemory(object);
    await enter(fields()[2] as HTMLInputElement, "7");
    await press("Write");
    object.write.mockRejectedValueOnce(new Error("read only now"));
    await press("Write");
    expect([text().includes("read only now"), text().includes("done")]).toEqual([true, false]);
  });
});

test("a property that was set is so, also where it cannot be read back", async () => {
  const get = vi.fn(() => Promise.resolve<unknown>(1));
  const set = vi.fn(() => Promise.resolve());
  show(PropertyRow, {
    object: { get, set } as unknown as Remote,
    member: memberOf("property", "double", "speed"),
    live: true,
    route: { page: "service", device: "d", service: "s", path: [] },
  } as unknown as MemberRowProps);
  await settle();
  get.mockRejectedValueOnce(new Error("not ready"));
  await enter(find<HTMLInputElement>("input"), "5");
  await press("Set speed");
  expect(set).toHaveBeenCalledWith("speed", 5, expect.anything());
  expect(find(".failure").textContent).toBe("not ready");
  expect(find(".failure").nextElementSibling).toBe(find("form")); // at what was read
});
