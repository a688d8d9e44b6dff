// The object locks that this page has in a session. They stay while the device is away, and end with the session.
// Layer: web/robot.

import { Store } from "../app/store";

export interface OwnLock {
  since: number;
  unlock: () => Promise<void>;
}

export class OwnLocks {
  /** By the object's path. */
  readonly state = new Store<ReadonlyMap<string, OwnLock>>(new Map());

  add(path: string, unlock: () => Promise<void>): void {
    this.state.value = new Map(this.state.value).set(path, { since: Date.now(), unlock });
  }

  delete(path: string): void {
    const rest = new Map(this.state.value);
    rest.delete(path);
    this.state.value = rest;
  }

  /** Unlocks what holds the object at `path`. @returns whether anything did. */
  async giveUp(path: string): Promise<boolean> {
    const held = [...this.state.value].filter(([locked]) => path === locked || path.startsWith(`${locked}.`));
    for (const [locked, { unlock }] of held) {
      this.delete(locked);
      await unlock().catch(() => undefined); // it had ended already
    }
    return held.length > 0;
  }
}
