// One service of one device: keeps it connected, and shows the robot's page where the object is a Create, else its members.
// Layer: web/pages.

import { useEffect, useState } from "preact/hooks";
import { format_route } from "../app/router";
import type { PathStep, Route } from "../app/router";
import { useStore } from "../app/store";
import { devices_of, relay_url } from "../gateway/devices";
import type { DeviceList } from "../gateway/devices";
import { is_usb, usb_url } from "../gateway/usb_devices";
import { Link } from "../robot/link";
import { explain, open_remote } from "../robot/remote";
import type { Remote } from "../robot/remote";
import { is_create } from "../robot/robot_model";
import { LinkStrip } from "../ui/link_strip";
import { ObjectView } from "./object_view";
import { RobotPage } from "./robot_page";

type ServiceRoute = Route & { page: "service" };

export function ServicePage({ route, list }: { route: ServiceRoute; list: DeviceList }) {
  const { device, service, path, view } = route;
  const link = useLink(device, service, list);
  const robot = useRobot(link, device, service, list);
  const drives = robot && path.length === 0;
  return (
    <div class={`page ${drives && view === "auto" ? "page-wide" : "page-narrow"}`}>
      <div class="service-head">
        <h1 class="place-name">{device}</h1>
        {link && <LinkStrip link={link} list={list} device={device} service={service} />}
        {drives && (
          <nav class="tabs" aria-label="Views of this service">
            <a href={format_route(device, service)} aria-current={view === "auto" ? "page" : undefined}>
              Drive
            </a>
            <a href={format_route(device, service, [], "members")} aria-current={view === "members" ? "page" : undefined}>
              All members
            </a>
          </nav>
        )}
      </div>
      {drives && link && <div hidden={view !== "auto"}><RobotPage link={link} list={list} device={device} shown={view === "auto"} /></div>}
      {link && (!drives || view === "members") && <MembersPage link={link} route={route} path={path} />}
    </div>
  );
}

function useLink(device: string, service: string, list: DeviceList): Link | null {
  const [link, set_link] = useState<Link | null>(null);
  useEffect(() => {
    const url = is_usb(device) ? usb_url(device, service) : relay_url(device, service);
    const made = new Link((signal) => open_remote(url, signal));
    set_link(made);
    let was_online = true;
    const unwatch = list.state.watch((gateway) => {
      const known = gateway.kind === "known" && gateway.devices.find((d) => d.name === device);
      const is_online = known !== false && known?.state === "online";
      if (is_online && !was_online) made.device_is_back();
      was_online = is_online;
    });
    return () => {
      unwatch();
      made.dispose();
    };
  }, [device, service, list]);
  return link;
}

/** Whether this is the demo robot: by what the gateway says at first, by the object itself once connected; then for good. */
function useRobot(link: Link | null, device: string, service: string, list: DeviceList): boolean {
  const gateway = useStore(list.state);
  const [by_object, set_by_object] = useState<boolean | null>(null);
  useEffect(() => {
    if (!link) return;
    const look = (): void => {
      if (link.state.value.kind === "online") set_by_object(is_create(link.state.value.remote));
    };
    look();
    return link.state.watch(look);
  }, [link]);
  if (by_object !== null) return by_object;
  const known = devices_of(gateway)?.find((d) => d.name === device)?.services.find((s) => s.name === service);
  return /^experimental\.(create\d*\.Create|simulatedcreate\.SimulatedCreate)$/.test(known?.type ?? "");
}

/** The object that the path leads to, found anew on every connection. */
function MembersPage({ link, route, path }: { link: Link; route: ServiceRoute; path: readonly PathStep[] }) {
  const state = useStore(link.state);
  const remote = state.kind === "online" ? state.remote : null;
  const [found, set_found] = useState<{ object: Remote; of: Remote } | null>(null);
  const [failure, set_failure] = useState<string | null>(null);
  const key = JSON.stringify(path);
  useEffect(() => {
    if (!remote) return;
    let current = true;
    set_failure(null);
    walk(remote, path).then(
      (object) => current && set_found({ object, of: remote }),
      (error: unknown) => current && set_failure(explain(error)),
    );
    return () => void (current = false);
  }, [remote, key]);
  if (failure !== null && remote) {
    return (
      <p class="failure" role="alert">
        {failure}
      </p>
    );
  }
  if (!found) return <div class="members-loading" aria-hidden="true"><span class="bone" /><span class="bone" /><span class="bone" /></div>;
  return <ObjectView key={`${key}:${found.object.type}`} object={found.object} live={found.of === remote} route={route} />;
}

async function walk(root: Remote, path: readonly PathStep[]): Promise<Remote> {
  let object = root;
  for (const { member, index } of path) {
    const declared = object.members.find((m) => m.name === member && m.kind === "objref");
    if (!declared) throw new Error(`${object.type} has no object "${member}"`);
    const by_number = /(\{int32\}|\[\])$/.test(declared.type);
    object = await object.child(member, index === null ? undefined : by_number ? Number(index) : index);
  }
  return object;
}
