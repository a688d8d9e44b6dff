// A person at a page, in any engine: finds things by their names, and waits until they are there.
import { expect } from "@playwright/test";
import type { Engine } from "./engine";
import { KEYS } from "./engine";

/** By a selector, and a name where it has one: its label, or its text. */
export interface Thing {
  css: string;
  name?: string;
}

export const button = (name: string): Thing => ({ css: "button", name });
export const field = (name: string): Thing => ({ css: "input, select, textarea", name });
export const link = (name: string): Thing => ({ css: "a", name });

interface Look {
  x: number;
  y: number;
  text: string;
}

export class Visitor {
  readonly #engine: Engine;

  constructor(engine: Engine) {
    this.#engine = engine;
  }

  async run<T>(work: (...args: any[]) => T | Promise<T>, ...args: unknown[]): Promise<T> {
    return (await this.#engine.run(work.toString(), args)) as T;
  }

  async open(url: string): Promise<void> {
    await this.#engine.open(url);
    await this.run(() => {
      const complaints: string[] = [];
      Object.assign(window, { complaints });
      window.addEventListener("error", ({ message }) => complaints.push(message));
      window.addEventListener("unhandledrejection", ({ reason }) => complaints.push(String(reason)));
      document.addEventListener("securitypolicyviolation", ({ blockedURI }) => complaints.push(blockedURI));
    });
  }

  /** What the page that was opened last has to be ashamed of. */
  async complaints(): Promise<string[]> {
    return this.run(() => (window as unknown as { complaints: string[] }).complaints);
  }

  /** Until it is there, and its text is like that. */
  async see(thing: Thing, text = /^/): Promise<void> {
    await expect
      .poll(async () => (await this.#look(thing))?.text ?? null, { message: JSON.stringify(thing), intervals: [100] })
      .toMatch(text);
  }

  /** @returns its text once two looks, 300 ms apart, have found the same. */
  async settled(thing: Thing): Promise<string> {
    let last: string | null = null;
    await expect(async () => {
      const before = last;
      last = (await this.#look(thing))?.text ?? null;
      expect(last).not.toBeNull();
      expect(last).toBe(before);
    }).toPass({ intervals: [300] });
    return last!;
  }

  async press(thing: Thing): Promise<void> {
    const letGo = await this.hold(thing);
    await letGo();
  }

  /** @returns what lets go of it. */
  async hold(thing: Thing): Promise<() => Promise<void>> {
    await this.see(thing);
    const { x, y } = await this.#whereItStays(thing);
    await this.#engine.pointer("down", x, y);
    return () => this.#engine.pointer("up", x, y);
  }

  /** What is loaded around it may still move it. */
  async #whereItStays(thing: Thing): Promise<Look> {
    let last: Look | null = null;
    await expect(async () => {
      const before = last;
      last = await this.#look(thing);
      expect(last && [last.x, last.y]).toEqual(before && [before.x, before.y]);
      expect(last).not.toBeNull();
    }).toPass({ intervals: [150], timeout: 15_000 });
    return last!;
  }

  async holdKey(key: keyof typeof KEYS): Promise<() => Promise<void>> {
    await this.#engine.key("down", KEYS[key]);
    return () => this.#engine.key("up", KEYS[key]);
  }

  async write(thing: Thing, text: string): Promise<void> {
    await this.press(thing);
    for (const character of text) {
      await this.#engine.key("down", character);
      await this.#engine.key("up", character);
    }
    await expect.poll(() => this.run(() => (document.activeElement as HTMLInputElement).value)).toBe(text);
  }

  /** The lists of browsers open windows that no WebDriver reaches. */
  async choose(thing: Thing, value: string): Promise<void> {
    const choose = async (): Promise<boolean> => {
      await this.see(thing);
      return this.run(
        (found: string, value: string) => {
          const select = document.querySelector<HTMLSelectElement>(found);
          if (![...(select?.options ?? [])].some((option) => option.value === value)) return false; // not yet
          select!.value = value;
          select!.dispatchEvent(new Event("change", { bubbles: true }));
          return true;
        },
        "[data-looked-at]",
        value,
      );
    };
    await expect.poll(choose, { message: `${value} in ${JSON.stringify(thing)}`, intervals: [100] }).toBe(true);
  }

  async resize(width: number, height: number): Promise<void> {
    await this.#engine.resize({ width, height });
  }

  /** The first that can be seen, and reached where it is; null where there is none. */
  async #look(thing: Thing): Promise<Look | null> {
    return this.run(({ css, name }: Thing) => {
      const nameOf = (element: Element): string => {
        const { labels } = element as HTMLInputElement;
        const text = element.getAttribute("aria-label") ?? labels?.[0]?.firstChild?.textContent ?? element.textContent;
        return text.replace(/\s+/g, " ").trim();
      };
      const isDisabled = (element: Element) => (element as HTMLButtonElement).disabled === true;
      for (const last of document.querySelectorAll("[data-looked-at]")) last.removeAttribute("data-looked-at");
      for (const element of document.querySelectorAll(css)) {
        if (isDisabled(element) || (name !== undefined && nameOf(element) !== name)) continue;
        const isThere = () => element.getClientRects().length > 0;
        if (!isThere()) continue;
        const inside = (): { x: number; y: number } => {
          const { left, top, width, height } = element.getBoundingClientRect();
          return { x: left + width / 2, y: top + height / 2 };
        };
        let { x, y } = inside();
        if (x < 0 || y < 0 || x >= innerWidth || y >= innerHeight) {
          element.scrollIntoView({ block: "center", behavior: "instant" });
          ({ x, y } = inside());
        }
        element.setAttribute("data-looked-at", "");
        return { x, y, text: (element as HTMLElement).innerText ?? element.textContent ?? "" };
      }
      return null;
    }, thing);
  }
}
