// The time line of a device that is a replay, whose controls are loaded for such devices alone.
// Layer: web/pages. Source: robdef/org.rrgate.replay.robdef.

import { useStore } from "../app/store";
import { devicesOf } from "../gateway/devices";
import type { DeviceList } from "../gateway/devices";
import type { Link } from "../robot/link";
import { loaded } from "../ui/loaded";
import type { ReplayControlsProps } from "./replay_controls";

const TYPE = "org.rrgate.replay.Replay";

const LoadedControls = loaded<ReplayControlsProps>(() => import("./replay_controls"));

export interface ReplayBarProps {
  link: Link;
  device: string;
  list: DeviceList;
}

/** Nothing for a device that is no replay. */
export function ReplayBar({ link, device, list }: ReplayBarProps) {
  const services = devicesOf(useStore(list.state))?.find(({ name }) => name === device)?.services ?? [];
  const service = controlAmong(services.filter(({ type }) => type === TYPE));
  if (!service) return null;
  return <LoadedControls link={link} from={[device, service.name].map(encodeURIComponent).join("/")} list={list} />;
}

/** Where services of the names "replay", "replay_2", ... were recorded, the one that controls has the first free name. */
function controlAmong<S extends { name: string }>(services: readonly S[]): S | undefined {
  const find = (wanted: string): S | undefined => services.find(({ name }) => name === wanted);
  let found = find("replay");
  for (let number = 2; found; number += 1) {
    const next = find(`replay_${number}`);
    if (!next) break;
    found = next;
  }
  return found ?? services[0];
}
