// An object that does nothing of itself but be stopped. Test support.
import { OwnLocks } from "../../web/src/robot/own_locks";
import type { Member } from "../../web/src/robot/remote";
import { UnderWay } from "../../web/src/robot/under_way";

export const remoteOf = (members: readonly Member[]) => ({
  type: "a.b.Robot",
  path: "Robot",
  members,
  definitions: ["service a.b\n"],
  underWay: new UnderWay(),
  locks: new OwnLocks(),
  controls: new Map(),
  onReleased: () => () => undefined,
  lease: () => Promise.reject(new Error("none")),
  ping: () => Promise.resolve(false),
  urgent: vi.fn(() => Promise.resolve<unknown>(undefined)),
});
