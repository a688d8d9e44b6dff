// A mode that is changed in steps: what ends it between them.
import { CommandMode } from "../../web/src/panels/command_mode";
import { tellStop } from "../../web/src/robot/control";

/** A robot and a gateway that answer when the test says so. */
function setup() {
  const steps: string[] = [];
  let answer: () => void = () => undefined;
  const step = (name: string) => {
    steps.push(name);
    return new Promise<void>((resolve) => (answer = resolve));
  };
  const control = { mayCommand: false, begin: () => step("begin").then(() => void (control.mayCommand = true)) };
  const object = { set: (name: string, value: unknown) => step(`${name} ${String(value)}`) };
  const mode = new CommandMode();
  const next = async () => {
    answer();
    for (let i = 0; i < 5; i++) await Promise.resolve();
  };
  return { steps, control, object, mode, next };
}

const all = ["begin", "command_mode 0", "command_mode 2"];

describe("a change of the mode", () => {
  it("goes by halt, once this page may command", async () => {
    const { steps, control, object, mode, next } = setup();
    const changed = mode.change(object, control, 2);
    for (let i = 1; i <= 3; i++) {
      expect(steps).toEqual(all.slice(0, i));
      await next();
    }
    expect(await changed).toBe(true);
  });
  it("begins where nobody gives leases, and by who came after another had left", async () => {
    const { steps, object, mode, next } = setup();
    mode.leave();
    const changed = mode.change(object, null, 2);
    for (let i = 0; i < 3; i++) await next();
    expect([steps, await changed]).toEqual([all.slice(1), true]);
  });

  type Setup = ReturnType<typeof setup>;
  const ends: [string, (given: Setup) => void][] = [
    ["the panel is left", ({ mode }) => mode.leave()],
    ["somebody asks for a stop", () => tellStop()],
  ];
  const givenBack: [string, (given: Setup) => void] = [
    "the right is given back",
    ({ control }) => (control.mayCommand = false),
  ];
  it.each([
    ...ends.map(([what, end]) => [1, what, end] as const),
    ...[...ends, givenBack].flatMap(([what, end]) => [[2, what, end] as const, [3, what, end] as const]),
  ])("ends with step %i where %s during it", async (count, _, end) => {
    const given = setup();
    const changed = given.mode.change(given.object, given.control, 2);
    for (let i = 1; i < count; i++) await given.next();
    end(given);
    await given.next();
    expect([given.steps, await changed]).toEqual([all.slice(0, count), false]);
  });
});
