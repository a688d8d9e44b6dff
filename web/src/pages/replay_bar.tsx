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

/** Where replays were recorded, there are several of the type: the one that controls has the greatest number. */
export function controlAmong<S extends { name: string }>(services: readonly S[]): S | undefined {
  const number = ({ name }: S): number => (name === "replay" ? 1 : Number(/^replay_(\d+)$/.exec(name)?.[1] ?? 0));
  return [...services].sort((a, b) => number(b) - number(a))[0];
}
