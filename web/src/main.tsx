// Start of the dashboard: builds the parts, joins them, and shows the page that the address names.
// Layer: web.

import { render } from "preact";
import { App } from "./app/app";
import { loadLanguage } from "./app/language";
import { watchRoute } from "./app/router";
import { AccessDesk } from "./gateway/access";
import { AgentsDesk } from "./gateway/agents";
import { DeviceList } from "./gateway/devices";
import { mustSignIn, session } from "./gateway/session";
import { UsbDeviceList } from "./gateway/usb_devices";
import "./styles/tokens.css";
import "./styles/base.css";
import "./styles/controls.css";
import "./styles/agents.css";
import "./styles/members.css";

const list = new DeviceList();
let isAsking = false;
const askIfAllowed = (): void => {
  const next = !mustSignIn(session.who.value);
  if (next === isAsking) return;
  isAsking = next;
  if (next) list.start();
  else list.stop();
};
void session.start().then(() => {
  askIfAllowed();
  session.who.watch(askIfAllowed);
});
const usb = new UsbDeviceList();
usb.start();
const access = new AccessDesk(session);
access.start();
const agents = new AgentsDesk(session);
agents.start();

// The code of a part of the page is asked for again where it did not come, but Vite asks for its stylesheet only once.
const STYLE_PAUSE_MS = 2_000;
const askAgain = ({ target }: Event): void => {
  if (!(target instanceof HTMLLinkElement) || target.rel !== "stylesheet") return;
  setTimeout(() => target.replaceWith(target.cloneNode()), STYLE_PAUSE_MS);
};
document.addEventListener("error", askAgain, { capture: true });

const place = document.getElementById("app");
if (!place) throw new Error("index.html has no element #app");
const show = (): void =>
  render(<App route={watchRoute()} list={list} usb={usb} access={access} agents={agents} session={session} />, place);
loadLanguage().then(show, show); // in English, where the other texts cannot be had

// For "install", and for the page that says that there is no gateway; browsers have it over HTTPS and on this machine.
void navigator.serviceWorker?.register("sw.js").catch(() => undefined);
