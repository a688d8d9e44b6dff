// What the examples of wasm-client/README.md have around them.
import type * as client from "rrgate-client";

declare global {
  const connect: typeof client.connect;
  const subscribe: typeof client.subscribe;
  const robot: client.Client<client.RemoteObject>;
  const token: string;
  const button: HTMLButtonElement;
  const label: HTMLLabelElement;
  const slider: { max: unknown };
  const form: { append(...field: string[]): void };
  const stick: { disable(why: string): void };
}
