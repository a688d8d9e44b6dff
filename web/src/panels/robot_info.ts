// What a standard robot says of itself: limits, names and chains, read on each connection, and never taken for those of another robot.
// Layer: web/panels. Source: com.robotraconteur.robotics.robot, robot_info.

import { useEffect, useState } from "preact/hooks";
import { pause } from "../live/pause";
import { explain } from "../robot/remote";
import type { Remote } from "../robot/remote";

const FIRST_RETRY_MS = 1_000;
const LONGEST_RETRY_MS = 30_000;

export interface RobotInfo {
  /** Of `object`, or of the last one while there is none; undefined: not known. */
  info: unknown;
  /** Why not. */
  failure: string | null;
}

const NOTHING: RobotInfo = { info: undefined, failure: null };

/** What fails is tried again, more and more rarely. `isRobot`: whether there is anything to read. */
export function useRobotInfo(object: Remote | null, isRobot: boolean): RobotInfo {
  const [found, setFound] = useState<RobotInfo & { object: Remote | null }>({ ...NOTHING, object: null });
  useEffect(() => {
    if (!object || !isRobot) return;
    const stop = new AbortController();
    void keepReading(object, stop.signal, (next) => setFound({ ...next, object }));
    return () => stop.abort();
  }, [object, isRobot]);
  return object === null || found.object === object ? found : NOTHING;
}

async function keepReading(object: Remote, signal: AbortSignal, told: (info: RobotInfo) => void): Promise<void> {
  for (let waits = FIRST_RETRY_MS; !signal.aborted; waits = Math.min(LONGEST_RETRY_MS, waits * 2)) {
    try {
      const info = await object.get("robot_info");
      if (!signal.aborted) told({ info, failure: null });
      return;
    } catch (error) {
      if (signal.aborted) return;
      told({ info: undefined, failure: explain(error) });
    }
    await pause(waits, signal);
  }
}
