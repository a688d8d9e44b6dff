// What a standard robot says of itself: limits, names and chains, read on each connection, and never taken for those of another robot.
// Layer: web/panels. Source: com.robotraconteur.robotics.robot, robot_info.

import { useEffect, useState } from "preact/hooks";
import { untilDone } from "../live/pause";
import { explain } from "../robot/remote";
import type { Remote } from "../robot/remote";

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
    const read = async (): Promise<void> => {
      const info = await object.get("robot_info");
      if (!stop.signal.aborted) setFound({ info, failure: null, object });
    };
    const failed = (error: unknown): void => setFound({ info: undefined, failure: explain(error), object });
    void untilDone(read, failed, stop.signal);
    return () => stop.abort();
  }, [object, isRobot]);
  return object === null || found.object === object ? found : NOTHING;
}
