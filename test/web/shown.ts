// Components in a page without a browser: what they show, and what a person does there. Import it before them: some look at
// the page when they are loaded.
import { h, options, render } from "preact";
import type { ComponentType } from "preact";
import { Window } from "happy-dom";

const window = new Window({ url: "http://gateway/" });
const { document, history, localStorage, HTMLElement, Event, EventTarget, KeyboardEvent, MouseEvent, PointerEvent } =
  window;
Object.assign(globalThis, { window, document, history, localStorage });
Object.assign(globalThis, { HTMLElement, Event, EventTarget, KeyboardEvent, MouseEvent, PointerEvent });
Object.assign(globalThis, {
  requestAnimationFrame: (draw: () => void) => setTimeout(draw),
  cancelAnimationFrame: clearTimeout,
  matchMedia: window.matchMedia.bind(window),
});
// At once, so that nothing here waits for a time.
options.requestAnimationFrame = queueMicrotask;
options.debounceRendering = queueMicrotask;
const root = globalThis.document.body;

/** A component in the page, and again with what has changed of its properties. */
export function show<P extends object>(component: ComponentType<P>, first: P): (next?: Partial<P>) => Promise<void> {
  let props = first;
  const update = (next: Partial<P> = {}): Promise<void> => {
    props = { ...props, ...next };
    render(h(component, props), root);
    return settle();
  };
  void update();
  return update;
}

export function clear(): void {
  render(null, root);
}

/** Until effects, and what they begin, have run. */
export async function settle(): Promise<void> {
  for (let turn = 0; turn < 5; ++turn) await new Promise((resolve) => setTimeout(resolve));
}

export function find<E extends HTMLElement>(selector: string): E {
  const found = root.querySelector<E>(selector);
  if (!found) throw new Error(`no ${selector} in ${root.innerHTML}`);
  return found;
}

export const text = (): string => root.textContent ?? "";

/** @throws Error where there is no such button, or more than one. */
export function button(name: string): HTMLButtonElement {
  const named = [...root.querySelectorAll("button")].filter((each) => each.textContent?.trim() === name);
  const [found] = named;
  if (!found || named.length > 1) throw new Error(`${named.length} buttons "${name}" in ${root.innerHTML}`);
  return found;
}

export async function press(name: string): Promise<void> {
  button(name).click();
  await settle();
}

/** Types a text into a field, or chooses an option. */
export async function enter(field: HTMLInputElement | HTMLSelectElement, value: string): Promise<void> {
  field.value = value;
  for (const kind of ["input", "change"]) field.dispatchEvent(new globalThis.Event(kind, { bubbles: true }));
  await settle();
}
