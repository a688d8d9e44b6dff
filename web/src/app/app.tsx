// The frame around every page: head line, the news about the gateway, and the page that the address names.
// Layer: web/app.

import { useEffect, useRef, useState } from "preact/hooks";
import { chooseLanguage, language, LANGUAGES, t } from "./language";
import type { Language } from "./language";
import { useStore } from "./store";
import type { Store } from "./store";
import { formatRoute, formatStep } from "./router";
import type { Route } from "./router";
import { theme } from "./theme";
import type { Theme } from "./theme";
import type { DeviceList } from "../gateway/devices";
import type { UsbDeviceList } from "../gateway/usb_devices";
import type { AccessDesk } from "../gateway/access";
import type { AgentsDesk } from "../gateway/agents";
import { isSignedOut, mustSignIn } from "../gateway/session";
import type { Session, Who } from "../gateway/session";
import type { DevicesPageProps } from "../pages/devices_page";
import { ServicePage } from "../pages/service_page";
import type { RecordingsProps } from "../pages/recordings_page";
import { AgentsPart } from "../pages/agents_part";
import { Account, SignInPage } from "../pages/sign_in_page";
import { loaded } from "../ui/loaded";
import { LanguageIcon, Mark, SunMoonIcon } from "../ui/icons";

interface AppParts {
  route: Store<Route>;
  list: DeviceList;
  usb: UsbDeviceList;
  access: AccessDesk;
  agents: AgentsDesk;
  session: Session;
}

export function App({ route, list, usb, access, agents, session }: AppParts) {
  const where = useStore(route);
  const main = useRef<HTMLElement>(null);
  const who = useStore(session.who);
  const [asked, setAsked] = useState(false);
  const expired = useStore(session.trouble);
  const isForm = mustSignIn(who) || (asked && who?.user === null);
  // A device that a page is open for may be moving: who is to sign in again can still stop it.
  const onlyStop = isForm && where.page === "service" && (expired !== null || !mustSignIn(who));
  const turn = useTurn(who);
  const title = isForm ? t("Sign in") : titleOf(where);
  const first = useRef(true);
  useEffect(() => {
    document.title = title === "" ? "rrgate" : `${title} · rrgate`;
    // A new page is a new place for the keyboard and the screen reader, but not on arrival. The form has its own.
    if (!first.current && !isForm) main.current?.focus({ preventScroll: true });
    first.current = false;
  }, [title]);
  return (
    <>
      <a class="skip" href="#main" onClick={(event) => (event.preventDefault(), main.current?.focus())}>
        {t("Skip to content")}
      </a>
      <header class="head">
        <a class="brand" href="#/">
          <Mark />
          <span>rrgate</span>
        </a>
        {!isForm && <Places route={where} />}
        {(!isForm || onlyStop) && <Crumbs route={where} />}
        <Account session={session} ask={() => setAsked(true)} />
        <LanguageSelect />
        <ThemeButton />
      </header>
      <main id="main" ref={main} tabIndex={-1}>
        {!isForm && <AgentsPart agents={agents} />}
        {(!isForm || onlyStop) && (
          <Page key={turn} route={where} list={list} usb={usb} access={access} agents={agents} onlyStop={onlyStop} />
        )}
        {isForm && <SignInPage session={session} done={() => setAsked(false)} />}
      </main>
    </>
  );
}

/** Another number for another user: a page begins anew, since its connections are those of the one before. */
function useTurn(who: Who | null): number {
  const last = useRef<string | null>(null);
  const turn = useRef(0);
  if (who !== null && !isSignedOut(who)) {
    if (last.current !== null && last.current !== who.user) turn.current += 1;
    last.current = who.user;
  }
  return turn.current;
}

type PageParts = Omit<AppParts, "route" | "session"> & { route: Route; onlyStop: boolean };

const LoadedDevices = loaded<DevicesPageProps>(() => import("../pages/devices_page"));
const LoadedRecordings = loaded<RecordingsProps>(() => import("../pages/recordings_page"));

function Page({ route: where, list, usb, access, agents, onlyStop }: PageParts) {
  return (
    <>
      {where.page === "devices" && <LoadedDevices list={list} usb={usb} access={access} agents={agents} />}
      {where.page === "recordings" && <LoadedRecordings list={list} />}
      {where.page === "service" && (
        <ServicePage key={`${where.device}/${where.service}`} route={where} list={list} onlyStop={onlyStop} />
      )}
      {where.page === "unknown" && <UnknownPage address={where.address} />}
    </>
  );
}

/** The pages that are about no device. The way back to the first is the mark, where there is little room. */
function Places({ route }: { route: Route }) {
  const places = [
    { page: "devices", href: "#/", text: t("Devices") },
    { page: "recordings", href: "#/recordings", text: t("Recordings") },
  ];
  return (
    <nav class={`places ${route.page === "service" ? "is-elsewhere" : ""}`} aria-label={t("Pages")}>
      {places.map(({ page, href, text }) => (
        <a key={page} href={href} aria-current={page === route.page ? "page" : undefined}>
          {text}
        </a>
      ))}
    </nav>
  );
}

function Crumbs({ route }: { route: Route }) {
  if (route.page !== "service") return <span class="crumbs" />;
  const { device, service, path, view } = route;
  const links = [
    { text: device, href: path.length > 0 || view === "members" ? formatRoute(device, service) : null },
    ...path.map((step, depth) => ({
      text: formatStep(step),
      href: depth < path.length - 1 ? formatRoute(device, service, path.slice(0, depth + 1)) : null,
    })),
  ];
  return (
    <nav class="crumbs" aria-label={t("Where you are")}>
      <ol>
        {links.map(({ text, href }) => (
          <li key={text}>{href === null ? <span aria-current="page">{text}</span> : <a href={href}>{text}</a>}</li>
        ))}
      </ol>
    </nav>
  );
}

const NEXT: Readonly<Record<Theme, Theme>> = { system: "light", light: "dark", dark: "system" };

function ThemeButton() {
  const chosen = useStore(theme);
  return (
    <button
      class="icon-button"
      type="button"
      title={t("Colours: {0}", t(chosen))}
      aria-label={t("Colours: {0}. Change to {1}", t(chosen), t(NEXT[chosen]))}
      onClick={() => (theme.value = NEXT[chosen])}
    >
      <SunMoonIcon theme={chosen} />
    </button>
  );
}

function LanguageSelect() {
  return (
    <label class="icon-button language" title={LANGUAGES[language]}>
      <span class="unseen">{t("Language")}</span>
      <LanguageIcon />
      <select value={language} onChange={(event) => chooseLanguage(event.currentTarget.value as Language)}>
        {Object.entries(LANGUAGES).map(([each, name]) => (
          <option key={each} value={each} lang={each}>
            {name}
          </option>
        ))}
      </select>
    </label>
  );
}

function UnknownPage({ address }: { address: string }) {
  return (
    <div class="page page-narrow">
      <h1>{t("No such page")}</h1>
      <div class="empty">
        <p>{t("There is nothing at this address:")}</p>
        <pre class="code">{address}</pre>
        <a class="button" href="#/">
          {t("All devices")}
        </a>
      </div>
    </div>
  );
}

function titleOf(route: Route): string {
  if (route.page === "devices") return t("Devices");
  if (route.page === "recordings") return t("Recordings");
  if (route.page === "unknown") return t("No such page");
  const last = route.path[route.path.length - 1];
  return last ? t("{0} of {1}", formatStep(last), route.device) : route.device;
}
