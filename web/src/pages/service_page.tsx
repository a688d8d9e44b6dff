// One service of one device: keeps it connected, and shows the robot's page where the object is a Create, else its members.
// Layer: web/pages.

import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import { t } from "../app/language";
import { formatRoute, formatStep } from "../app/router";
import type { Route, View } from "../app/router";
import { recallBoard } from "../board/board";
import { hasPreset, stopFor } from "../board/presets";
import type { BoardPageProps } from "../board/board_page";
import { StopButton, useSafe } from "../board/stop";
import { useStore } from "../app/store";
import { devicesOf } from "../gateway/devices";
import type { DeviceList } from "../gateway/devices";
import { linkTo } from "../gateway/link_to";
import { isUsb } from "../gateway/usb_devices";
import { useObject } from "../live/links";
import type { Link } from "../robot/link";
import type { Remote } from "../robot/remote";
import type { StopCall } from "../robot/stop";
import { isCreate, isNamedCreate } from "../robot/is_create";
import { Definitions, scopeOf } from "../values/definitions";
import { LinkStrip } from "../ui/link_strip";
import { loaded } from "../ui/loaded";
import { RecordingMark } from "../ui/recording_mark";
import type { MembersPageProps } from "./members_page";
import { ReplayBar } from "./replay_bar";
import type { RobotPageProps } from "./robot_page";

type ServiceRoute = Route & { page: "service" };

export interface ServicePageProps {
  route: ServiceRoute;
  list: DeviceList;
  /** Nobody is signed in any more: the connection is kept, and of the page its stop. */
  onlyStop: boolean;
}

export function ServicePage({ route, list, onlyStop }: ServicePageProps) {
  const { device, service, path, view } = route;
  const isMissing = useMissing(device, list);
  const link = useLink(device, service, list, !isMissing);
  const robot = useRobot(link, device, service, list);
  const drives = robot && path.length === 0;
  const first = useFirstView(link, route, drives);
  const shown = view === "auto" || (view === "drive" && !drives) ? first : view;
  const isDriven = shown === "drive";
  // Kept from then on: what is under way on it goes on while another view is looked at.
  const wasDriven = useRef(false);
  wasDriven.current ||= isDriven;
  const [isBoardThere, isRobotThere] = [useStore(LoadedBoard.isThere), useStore(LoadedRobot.isThere)];
  const hasOwnStop = shown === "board" ? isBoardThere : isDriven && isRobotThere && !onlyStop;
  const width = shown === "members" || onlyStop ? "page-narrow" : `page-wide ${shown === "board" ? "page-wall" : ""}`;
  return (
    <div class={`page ${width}`}>
      <div class="service-head">
        <div>
          <h1 class="place-name" title={device}>
            {device}
          </h1>
          <RecordingMark device={device} />
        </div>
        {link && <LinkStrip link={link} list={list} device={device} service={service} />}
        {link && !onlyStop && <Views route={route} shown={shown} first={first} drives={drives} />}
      </div>
      {link && <HeadStop link={link} route={route} list={list} isShown={!hasOwnStop} />}
      {drives && link && wasDriven.current && (
        <div hidden={!isDriven || onlyStop}>
          <LoadedRobot link={link} list={list} device={device} service={service} shown={isDriven && !onlyStop} />
        </div>
      )}
      {link && shown === "board" && <LoadedBoard link={link} route={route} list={list} onlyStop={onlyStop} />}
      {link && shown === "members" && !onlyStop && <LoadedMembers link={link} route={route} path={path} list={list} />}
      {link && !onlyStop && <ReplayBar link={link} device={device} list={list} />}
      {link && !onlyStop && <Unreached link={link} />}
      {isMissing && (
        <p class="empty">
          {t("The gateway has no device of this name. If one comes, it opens here by itself.")}{" "}
          <a href="#/">{t("All devices")}</a>
        </p>
      )}
    </div>
  );
}

/** Nothing is known of a service that was not reached since the page was opened. */
function Unreached({ link }: { link: Link }) {
  const { kind } = useStore(link.state);
  const [wasOnline, setWasOnline] = useState(false);
  useEffect(() => void (kind === "online" && setWasOnline(true)), [kind]);
  if (wasOnline || kind !== "lost") return null;
  return (
    <section class="empty">
      <h2>{t("Nothing to show yet")}</h2>
      <p>{t("This service has not answered since the page was opened. It opens here by itself once it does.")}</p>
      <a class="button" href="#/">
        {t("All devices")}
      </a>
    </section>
  );
}

function Views({ route, shown, first, drives }: { route: ServiceRoute; shown: View; first: View; drives: boolean }) {
  const views: [View, string][] = [
    ...(drives ? ([["drive", t("Drive")]] as [View, string][]) : []),
    ["board", t("Board")],
    ["members", t("All members")],
  ];
  return (
    <nav class="tabs" aria-label={t("Views of this service")}>
      {views.map(([view, name]) => (
        <a
          key={view}
          href={formatRoute(route.device, route.service, route.path, view === first ? "auto" : view)}
          aria-current={view === shown ? "page" : undefined}
        >
          {name}
        </a>
      ))}
    </nav>
  );
}

interface HeadStopProps {
  link: Link;
  route: ServiceRoute;
  list: DeviceList;
  /** What stops the device is learned meanwhile, too: there may be no connection when it is wanted. */
  isShown: boolean;
}

/** Of the object that is shown, else of the service. A board and the demo robot have their own, once they are loaded. */
function HeadStop({ link, route, list, isShown }: HeadStopProps) {
  const shown = useObject(link, "", route.path.map(formatStep).join("."), list);
  const root = useObject(link, "", "", list);
  const [own, service] = [useStop(shown.last), useStop(root.last)];
  const safe = useSafe(route, list);
  if (!isShown) return null;
  if (own) return <StopButton object={shown.reach} stop={own} place={route} safe={safe} />;
  return <StopButton object={root.reach} stop={service} place={route} safe={safe} />;
}

function useStop(object: Remote | null): StopCall | null {
  return useMemo(() => {
    if (!object) return null;
    const { type, members } = object;
    return stopFor({ type, members, definitions: new Definitions(object.definitions), scope: scopeOf(type) });
  }, [object]);
}

/** What an address without a view shows: the demo robot's page, a board that was made or is known to fit, else all members. */
function useFirstView(link: Link | null, route: ServiceRoute, drives: boolean): View {
  const [isKnown, setKnown] = useState(false);
  const isMade = useRef(recallBoard([route.device, route.service].map(encodeURIComponent).join("/")) !== null).current;
  useEffect(() => {
    if (!link) return;
    const look = (): void => {
      const state = link.state.value;
      if (state.kind === "online") setKnown(hasPreset(state.remote.type, new Definitions(state.remote.definitions)));
    };
    look();
    return link.state.watch(look);
  }, [link]);
  if (drives) return "drive";
  return route.path.length === 0 && (isKnown || isMade) ? "board" : "members";
}

const LoadedBoard = loaded<BoardPageProps>(() => import("../board/board_page"));
const LoadedRobot = loaded<RobotPageProps>(() => import("./robot_page"));
const LoadedMembers = loaded<MembersPageProps>(() => import("./members_page"));

/** Whether the gateway knows no such device, and knew none since the page was opened: one that goes away stays shown. */
function useMissing(device: string, list: DeviceList): boolean {
  const known = devicesOf(useStore(list.state));
  const wasThere = useRef(isUsb(device));
  if (known?.some((d) => d.name === device)) wasThere.current = true;
  return known !== null && !wasThere.current;
}

function useLink(device: string, service: string, list: DeviceList, isWanted: boolean): Link | null {
  const [link, setLink] = useState<Link | null>(null);
  useEffect(() => {
    if (!isWanted) return setLink(null);
    const { link: made, dispose } = linkTo(device, service, list);
    setLink(made);
    return dispose;
  }, [device, service, list, isWanted]);
  return link;
}

/** Whether this is the demo robot: by what the gateway says at first, by the object itself once connected; then for good. */
function useRobot(link: Link | null, device: string, service: string, list: DeviceList): boolean {
  const gateway = useStore(list.state);
  const [byObject, setByObject] = useState<boolean | null>(null);
  useEffect(() => {
    if (!link) return;
    const look = (): void => {
      if (link.state.value.kind === "online") setByObject(isCreate(link.state.value.remote));
    };
    look();
    return link.state.watch(look);
  }, [link]);
  if (byObject !== null) return byObject;
  const known = devicesOf(gateway)
    ?.find((d) => d.name === device)
    ?.services.find((s) => s.name === service);
  return isNamedCreate(known?.type ?? "");
}
