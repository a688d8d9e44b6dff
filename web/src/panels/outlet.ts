// An endpoint of a pipe to send with: opened with the first packet, and anew with the next one after it was closed.
// Layer: web/panels, pure.

import type { Sender } from "../robot/remote";

export class Outlet {
  #sender: Promise<Sender> | null = null;

  constructor(private readonly open: () => Promise<Sender>) {}

  async send(value: unknown): Promise<void> {
    if ((await this.#sender)?.isClosed) this.#sender = null;
    this.#sender ??= this.open();
    const sender = await this.#sender.catch((error: unknown) => ((this.#sender = null), Promise.reject(error)));
    await sender.send(value);
  }

  close(): void {
    void this.#sender?.then((open) => open.close()).catch(() => undefined); // closing what never opened
    this.#sender = null;
  }
}
