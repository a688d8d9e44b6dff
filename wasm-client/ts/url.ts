// URLs of services. Layer: wasm-client/ts. Source: transports spec section 1.
import { makeError, textOf } from "./errors.js";

export interface ServiceUrl {
  /** What the transport opens: ws:, wss: or rr+usb:. */
  address: URL;
  service: string;
  nodeId: string | undefined;
  nodeName: string | undefined;
}

const schemes: Record<string, string> = {
  "ws:": "ws:",
  "wss:": "wss:",
  "http:": "ws:",
  "https:": "wss:",
  "rr+ws:": "ws:",
  "rr+wss:": "wss:",
  "rr+tcp:": "ws:", // the port of a node takes WebSockets as well
  "rr+usb:": "rr+usb:",
};
/** Of rr+usb:, behind it: no host and no path. */
const usbForm = /^\/\/(?:localhost)?\/?(\?[^#]*)?(?:#.*)?$/i;
const tcpPort = "48653";

/**
 * Reads "wss://host/devices/create?service=Create", the same with another scheme of the table above, or, in a page, a
 * URL relative to it; "rr+usb:///?nodename=robot&service=Create".
 * @throws RobotRaconteurError InvalidArgument
 */
export function parseServiceUrl(text: string | URL, base = globalThis.location?.href): ServiceUrl {
  const refuse = (why: string) => makeError("InvalidArgument", `URL "${String(text).slice(0, 200)}": ${why}`);
  const scheme = /^([a-z][a-z0-9+.-]*:)/i.exec(String(text))?.[1]?.toLowerCase();
  const rest = scheme === undefined ? String(text) : String(text).slice(scheme.length);
  if (scheme !== undefined && !(scheme in schemes)) {
    const known = Object.keys(schemes).map((name) => name.slice(0, -1));
    const why = scheme.startsWith("rrs+")
      ? "encryption inside of the stream is not available here, use rr+wss"
      : "scheme unknown";
    throw refuse(`${why}; known: ${known.join(", ")}`);
  }
  const isUsb = scheme === "rr+usb:";
  const address = isUsb ? usbAddress(rest, refuse) : socketAddress(scheme, rest, base, refuse);
  address.hash = "";
  const query = address.searchParams;
  const service = query.get("service");
  if (!service) throw refuse('names no service; add "?service=NAME"');
  const nodeId = query.get("nodeid") || undefined;
  const nodeName = query.get("nodename") || undefined;
  if (isUsb && !nodeId && !nodeName) throw refuse('names no node; add "nodeid=ID" or "nodename=NAME"');
  return { address, service, nodeId, nodeName };
}

type Refuse = (why: string) => Error;

function usbAddress(rest: string, refuse: Refuse): URL {
  const form = usbForm.exec(rest);
  if (!form) throw refuse("found a host, port or path; expected the like of rr+usb:///?nodename=robot&service=Robot");
  return new URL(`rr+usb:///${form[1] ?? ""}`);
}

function socketAddress(scheme: string | undefined, rest: string, base: string | undefined, refuse: Refuse): URL {
  try {
    // "http" is parsed like "ws", and unlike "rr+tcp" by the rules for hosts and ports.
    const parseable = scheme === undefined ? rest : `${schemes[scheme] === "wss:" ? "https:" : "http:"}${rest}`;
    const address = new URL(parseable, base);
    if (scheme === "rr+tcp:" && !/^\/\/[^/?#]*:\d+([/?#]|$)/.test(rest)) address.port = tcpPort;
    const to = schemes[address.protocol];
    if (!to) throw new TypeError(`scheme ${address.protocol} unknown`);
    address.protocol = to;
    return address;
  } catch (error) {
    const isRelative = scheme === undefined && base === undefined;
    const why = isRelative ? "there is no page that it could be relative to" : textOf(error);
    throw refuse(`${why}; expected the like of ws://host:8080/devices/robot?service=Robot`);
  }
}
