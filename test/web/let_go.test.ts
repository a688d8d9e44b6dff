// Letting go of what is held where no key-up and no pointer-up comes.
import { tellStop } from "../../web/src/robot/control";
import { isLeftUp, onLetGo } from "../../web/src/robot/let_go";

describe("what is held", () => {
  let letGo: ReturnType<typeof vi.fn<() => void>>;
  let forget: () => void;
  const page = Object.assign(new EventTarget(), { hidden: false });
  const frame = new EventTarget();
  beforeEach(() => {
    vi.stubGlobal("window", frame);
    vi.stubGlobal("document", page);
    page.hidden = false;
    letGo = vi.fn();
    forget = onLetGo(letGo);
  });
  afterEach(() => {
    forget();
    vi.unstubAllGlobals();
  });

  it.each(["blur", "pagehide", "contextmenu", "dragstart"])("is let go of with %s", (name) => {
    frame.dispatchEvent(new Event(name, { cancelable: true }));
    expect(letGo).toHaveBeenCalledOnce();
    forget();
    frame.dispatchEvent(new Event(name, { cancelable: true }));
    expect(letGo).toHaveBeenCalledOnce();
  });
  it.each(["contextmenu", "dragstart"])("stays held where the page has prevented %s", (name) => {
    const event = new Event(name, { cancelable: true });
    event.preventDefault();
    frame.dispatchEvent(event);
    expect(letGo).not.toHaveBeenCalled();
  });
  it("is let go of when the page is hidden, and not when it is shown again", () => {
    page.dispatchEvent(new Event("visibilitychange"));
    expect(letGo).not.toHaveBeenCalled();
    page.hidden = true;
    page.dispatchEvent(new Event("visibilitychange"));
    expect(letGo).toHaveBeenCalledOnce();
  });
  it("is let go of with a stop", () => {
    tellStop();
    expect(letGo).toHaveBeenCalledOnce();
    forget();
    tellStop();
    expect(letGo).toHaveBeenCalledOnce();
  });
});

describe("the left button", () => {
  function moved(given: { pointerType?: string; buttons: number; isCaptured?: boolean }) {
    const { pointerType = "mouse", buttons, isCaptured = true } = given;
    const currentTarget = { hasPointerCapture: () => isCaptured, releasePointerCapture: vi.fn() };
    return { pointerType, buttons, pointerId: 7, currentTarget };
  }
  it("is up where others are still pressed, and what it held is free", () => {
    for (const buttons of [0, 2, 4, 6]) {
      const event = moved({ buttons });
      expect(isLeftUp(event)).toBe(true);
      expect(event.currentTarget.releasePointerCapture.mock.calls).toEqual([[7]]);
    }
  });
  it.each([
    ["is down with another one", moved({ buttons: 3 })],
    ["holds nothing that the mouse only passes", moved({ buttons: 0, isCaptured: false })],
    ["is no finger's and no pen's", moved({ pointerType: "pen", buttons: 2 })],
  ])("%s", (_, event) => {
    expect(isLeftUp(event)).toBe(false);
    expect(event.currentTarget.releasePointerCapture).not.toHaveBeenCalled();
  });
});
