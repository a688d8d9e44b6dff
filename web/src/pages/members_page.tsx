// All members of one object of a service.
// Layer: web/pages.

import { useStore } from "../app/store";
import type { PathStep, Route } from "../app/router";
import { isShared } from "../gateway/devices";
import type { DeviceList } from "../gateway/devices";
import { useWalk } from "../live/links";
import { usePulse } from "../live/pulse";
import type { Link } from "../robot/link";
import { Silence } from "../ui/silence";
import { ObjectView } from "./object_view";

export interface MembersPageProps {
  link: Link;
  route: Route & { page: "service" };
  path: readonly PathStep[];
  list: DeviceList;
}

export default function MembersPage({ link, route, path, list }: MembersPageProps) {
  const state = useStore(link.state);
  const { object, last, failure } = useWalk(state, path);
  const silent = usePulse(object, isShared(useStore(list.state), route.device));
  if (failure !== null && state.kind === "online") {
    return (
      <p class="failure" role="alert">
        {failure}
      </p>
    );
  }
  if (!last) {
    if (state.kind === "lost") return null; // the strip above says why
    return (
      <div class="members-loading" aria-hidden="true">
        <span class="bone" />
        <span class="bone" />
        <span class="bone" />
      </div>
    );
  }
  const key = `${JSON.stringify(path)}:${last.type}`;
  return (
    <>
      <Silence silent={silent} />
      <ObjectView key={key} object={last} live={object !== null} route={route} />
    </>
  );
}
